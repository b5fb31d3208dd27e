"""Stress inside a disc between two plates

The equivalent stress of von Mises inside a disc that two rigid plates press together, evaluated from its
boundary. The largest stress lies inside the body above the contact, not at its surface.
"""

import bemkit as bk
from bemkit.pictures import draw_stress

scene = bk.load_scene("disc-between-plates")  # a quarter of the disc, by symmetry
axes = draw_stress(bk.run(scene), measure="von-mises")
figure = axes.get_figure()
