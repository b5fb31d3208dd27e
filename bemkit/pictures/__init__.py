"""Pictures of scenes and results: each function draws into axes of matplotlib, given or new, and returns them."""

from bemkit.pictures.animation import save_animation as save_animation
from bemkit.pictures.boundary_traction import draw_boundary_traction as draw_boundary_traction
from bemkit.pictures.catalogue import figures as figures
from bemkit.pictures.contact_curves import draw_contact_clearance as draw_contact_clearance
from bemkit.pictures.contact_curves import draw_contact_displacement as draw_contact_displacement
from bemkit.pictures.contact_curves import draw_contact_traction as draw_contact_traction
from bemkit.pictures.contact_curves import draw_friction_cone as draw_friction_cone
from bemkit.pictures.contact_map import draw_contact_map as draw_contact_map
from bemkit.pictures.contact_map import draw_zoom as draw_zoom
from bemkit.pictures.convergence import draw_convergence as draw_convergence
from bemkit.pictures.deformation import draw_deformation as draw_deformation
from bemkit.pictures.deformation import draw_scene as draw_scene
from bemkit.pictures.files import save_pictures as save_pictures
from bemkit.pictures.load_history import draw_friction_loop as draw_friction_loop
from bemkit.pictures.load_history import draw_status_over_time as draw_status_over_time
from bemkit.pictures.load_history import draw_work as draw_work
from bemkit.pictures.outline import draw_outline as draw_outline
from bemkit.pictures.stress import draw_stress as draw_stress
