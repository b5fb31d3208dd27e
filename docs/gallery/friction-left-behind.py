"""Friction left behind after a push

A block is pressed on a rigid foundation, is pushed to the right, and is let go. Friction does not let it
return: tractions remain along the foundation although nothing pushes any more. Poisson's ratio is zero, so that the
its own weight causes no friction.
"""

from dataclasses import replace

from matplotlib.figure import Figure

import bemkit as bk

scene = bk.Scene(
    title="Block under pressure, pushed and let go",
    shape=bk.Rectangle(width=1.0, height=0.5),
    material=bk.Material(youngs_modulus=1000.0, poisson_ratio=0.0),
    law=bk.Coulomb(friction_coefficient=0.4),
    parts=(
        bk.Part("foundation", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("weight", bk.Traction(y=-1.0), sides=("top",)),
        bk.Part("push", bk.Traction(x=0.0), sides=("left",)),
    ),
    mesh=bk.MeshOptions(elements=120),
)


def pushed(traction: float) -> bk.Scene:
    foundation, weight, push = scene.parts
    return replace(scene, parts=(foundation, weight, replace(push, condition=bk.Traction(x=traction))))


figure = Figure(figsize=(7.0, 4.0), layout="constrained")
axes = figure.subplots()
for name, solution in zip(
    ("only weight", "pushed", "let go"),
    bk.run([pushed(0.0), pushed(0.6), pushed(0.0)]),
    strict=True,
):
    axes.plot(solution.contact.x, solution.contact.sigma_t, label=f"{name}: sum {abs(solution.force_tangential):.3f}")
axes.set(xlabel="x", ylabel="friction on the block")
axes.legend()
