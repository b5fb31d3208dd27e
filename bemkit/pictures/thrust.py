"""The picture of a line of thrust: resultants between rigid blocks, where they act."""

from __future__ import annotations

import numpy as np

from bemkit.geometry.vectors import norms
from bemkit.model.rigid_blocks import JointForces
from bemkit.pictures.drawing import BLUE, VERMILION, Axes, axes_or_new
from bemkit.scene.scene import Scene
from bemkit.scene.unit_names import with_unit

_SEEN = np.linspace(0.0, 1.0, 33)
_LONGEST = 0.12
"""Length of the longest arrow, relative to the picture."""


def draw_thrust(scene: Scene, state: JointForces, axes: Axes | None = None) -> Axes:
    """Draw the blocks, the force in each joint at its centre of pressure, and the line of thrust.

    The line joins the centres of pressure of each block that two joints load.

    Parameters
    ----------
    scene : Scene
    state : JointForces
        Of `bemkit.thrust`.
    axes : matplotlib axes, optional
    """
    axes = axes_or_new(axes, 7.0, 5.2)
    outlines = [
        body.placement.forward(side.curve.point(_SEEN))
        for body in scene.placed_bodies
        for side in body.shape.outline().sides
    ]
    for points in outlines:
        axes.plot(*points.T, color="0.6", linewidth=0.8)
    found = {joint: state.resultant(joint) for joint in range(len(state.names))}
    loaded = {joint: each for joint, each in found.items() if each is not None}
    for block in range(len(state.bodies)):
        ends = [centre for joint, (centre, _) in loaded.items() if block in state.blocks[joint]]
        if len(ends) == 2:
            axes.plot(*np.transpose(ends), color=BLUE, linewidth=1.6)
    if loaded:
        centres = np.array([centre for centre, _ in loaded.values()])
        forces = np.array([force for _, force in loaded.values()])
        size = float(np.ptp(np.concatenate(outlines), axis=0).max())
        arrows = _LONGEST * size * forces / norms(forces).max()
        axes.quiver(
            *(centres - arrows).T, *arrows.T, angles="xy", scale_units="xy", scale=1.0, color=VERMILION, width=0.003
        )
    axes.set_aspect("equal")
    axes.set_title(f"{scene.title}: thrust {state.value:.4g}", parse_math=False, fontsize=11)
    axes.set_xlabel(with_unit("x", "length", scene.units), parse_math=False)
    axes.set_ylabel(with_unit("y", "length", scene.units), parse_math=False)
    return axes
