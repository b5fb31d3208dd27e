"""The command ``bemkit plan``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import click

from bemkit.cli.options import degree_of, shown_progress
from bemkit.errors import concerning

if TYPE_CHECKING:
    from bemkit.plan import Plan
    from bemkit.scene.assembly import Assembly
    from bemkit.scene.scene import Scene


@click.command()
@click.argument("scene")
@click.option("--elements", type=int, metavar="N", help="Number of boundary elements, instead of the scene's.")
@click.option("--accuracy", type=float, metavar="E", help="Plan the first mesh towards a relative error below E.")
@click.option("--discretisation", metavar="WORD", help="hp, quadratic, linear or constant, instead of the scene's.")
@click.option(
    "--degree", metavar="P|hp", callback=degree_of, help="Galerkin elements of that degree, or of rising ones."
)
@click.option("--json", "is_json", is_flag=True, help="Print the plan as JSON.")
def plan(
    scene: str,
    elements: int | None,
    accuracy: float | None,
    discretisation: str | None,
    degree: int | Literal["hp"] | None,
    is_json: bool,
) -> None:
    """Say what SCENE needs and what it leaves out, without solving it."""
    with shown_progress(is_json):
        from bemkit.scene.toml import load_scene, with_overrides

        chosen = with_overrides(
            load_scene(scene), elements=elements, accuracy=accuracy, discretisation=discretisation, degree=degree
        )
        with concerning(scene):
            made = _planned(chosen)
    if is_json:
        from bemkit.results.outputs import json_text
        from bemkit.results.streams import print_data

        print_data(json_text(made.as_dict()))
    else:
        from bemkit.cli.console import print_plan

        print_plan(chosen.title, made)


def _planned(scene: Scene | Assembly) -> Plan:
    """Return the plan of a scene, with a symmetry that it could use."""
    from bemkit.scene.assembly import Assembly

    if isinstance(scene, Assembly):
        from bemkit.plan.assembly_plan import make_assembly_plan

        return make_assembly_plan(scene)
    from bemkit.plan import check_elements, make_plan
    from bemkit.scene.symmetry import find_symmetry

    check_elements(scene)
    proposal = find_symmetry(scene) if scene.symmetry is None else None
    return make_plan(scene, scene.build_mesh(), proposal=proposal)
