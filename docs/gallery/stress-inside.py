"""Stress inside a disc between two plates

The equivalent stress of von Mises inside a disc that two rigid plates press together, evaluated from its boundary
alone. The largest stress lies inside the body above the contact, not at its surface.
"""

import numpy as np
from matplotlib.figure import Figure

import bemkit as bk

scene = bk.load_scene("disc-between-plates")  # a quarter of the disc, by symmetry
assert isinstance(scene, bk.Scene)
fields = bk.interior_fields(bk.run(scene))
x, y = np.meshgrid(np.linspace(0.008, 0.992, 62), np.linspace(-0.992, -0.008, 62))
points = np.stack([x.ravel(), y.ravel()], axis=1)
is_inside = np.hypot(*points.T) < 0.996
stress = np.full(len(points), np.nan)
stress[is_inside] = bk.von_mises(fields.stress(points[is_inside]), scene.material.poisson_ratio, scene.material.plane)
figure = Figure(figsize=(6.0, 5.0), layout="constrained")
axes = figure.subplots()
drawn = axes.contourf(x, y, stress.reshape(x.shape), levels=20)
axes.set(xlabel="x", ylabel="y", aspect="equal")
figure.colorbar(drawn, label="von Mises stress")
