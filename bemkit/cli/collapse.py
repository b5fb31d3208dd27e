"""The command ``bemkit collapse``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from bemkit.cli import options
from bemkit.cli.options import shown_progress
from bemkit.cli.outputs import Outputs, json_of
from bemkit.errors import InputError, concerning
from bemkit.scene.unit_names import unit_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure

    from bemkit.contact.coulomb_limit import CoulombLimit
    from bemkit.model.rigid_blocks import JointForces
    from bemkit.scene.scene import Scene


@click.command()
@click.argument("scene")
@click.option("--thrust", "contact", metavar="CONTACT", help="Find the smallest and largest thrust at a contact.")
@click.option("--along", type=float, nargs=2, metavar="X Y", default=(1.0, 0.0), help="Direction of the thrust (1 0).")
@options.changes_scene("settings")
@options.json_option
@options.plot_option
def collapse(
    scene: str,
    contact: str | None,
    along: tuple[float, float],
    json_file: str | None,
    folder: str | None,
    load: Callable[[str], Scene],
) -> None:
    """Find the load factors at which the bodies of SCENE, as rigid blocks, collapse, or the thrust at a contact."""
    if folder is not None and contact is None:
        raise click.UsageError("--plot draws the line of thrust: add --thrust CONTACT")
    with shown_progress(quiet=False), concerning(scene):
        from bemkit.runs.collapse import coulomb_load_factor, thrust

        chosen = load(scene)
        if not chosen.bodies:
            raise InputError("the scene is a single body: give one with tables [bodies.NAME]")

        def pictures(states: tuple[JointForces, JointForces]) -> Mapping[str, Figure]:
            from bemkit.pictures.thrust import draw_thrust

            names = ("smallest-thrust", "largest-thrust")
            drawn: list[Any] = [draw_thrust(chosen, state).get_figure(root=True) for state in states]
            return dict(zip(names, drawn, strict=True))

        outputs: Outputs[dict[str, Any]] = Outputs((json_of(json_file, dict),))
        figures = Outputs((), folder, pictures, "smallest-thrust")
        figures.check(outputs.check())
        unit, per = unit_of("force", chosen.result_units), "" if chosen.thickness else "  per unit thickness"
        numbers: dict[str, Any]
        if contact is None:
            limit = coulomb_load_factor(chosen)
            numbers, lines = _limit_dict(limit), _limit_lines(limit)
        else:
            states = thrust(chosen, contact, along)
            numbers = {"contact": contact, "along": list(along)}
            lines = []
            for name, state in zip(("smallest", "largest"), states, strict=True):
                settlement = {body: list(motion) for body, motion in state.settlement.items()}
                numbers[name] = {"thrust": state.value, "settlement": settlement}
                moving = f"{len(settlement)} of {len(state.bodies)} bodies move when the support yields"
                lines.append(f"{name} thrust".ljust(17) + f"{f'{state.value:.6g} {unit}'.rstrip()}{per}; {moving}")
    outputs.write({"title": chosen.title, **numbers})
    if contact is not None:
        figures.write(states)
    if not outputs.uses_stdout:
        print("\n".join([chosen.title, *lines]))


def _limit_dict(limit: CoulombLimit) -> dict[str, float | None]:
    keys = ("held", "factor", "smallest", "associative")
    return {key: getattr(limit, key) if math.isfinite(getattr(limit, key)) else None for key in keys}


def _limit_lines(limit: CoulombLimit) -> list[str]:
    if math.isinf(limit.factor):
        return ["contacts and supports can hold any multiple of the load"]
    held = (
        f"{limit.held:.6g}  known forces let no motion begin" if math.isfinite(limit.held) else "no such forces found"
    )
    return [
        f"collapse with Coulomb friction  {limit.factor:.6g}  a motion begins from known forces",
        f"smallest collapse found         {limit.smallest:.6g}  from other forces",
        f"held                            {held}",
        f"bound from above                {limit.associative:.6g}  no forces balance more (sliding dilates)",
    ]
