"""The command ``bemkit plot``; what it needs is loaded behind its progress bar."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from bemkit.cli import options
from bemkit.cli.options import reserve, shown_progress
from bemkit.cli.process import exit_code_of


class _PlotCommand(click.Command):
    """Lists all pictures below its options."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a line for each picture."""
        from bemkit.pictures.catalogue import PICTURES
        from bemkit.pictures.files import ANIMATION

        rows = [(picture.name, picture.shows) for picture in PICTURES.values()]
        with formatter.section("Pictures"):
            formatter.write_dl([*rows, (ANIMATION, "the load steps as a moving picture: .gif, or .mp4 with ffmpeg")])


@click.command(cls=_PlotCommand)
@click.argument("source")
@options.what_option
@click.option(
    "-o", "--output", "target", default="figures", metavar="PATH", help="Write to a folder, or one picture to a file."
)
@click.option("--dpi", "dots_per_inch", type=click.IntRange(20, 1200), default=150, help="Dots per inch (150).")
@click.option(
    "--width", type=click.FloatRange(50.0), metavar="MM", help="For print: this width, text of 7 points, no title."
)
@options.quiet_option
def plot(
    source: str, what: tuple[str, ...] | None, target: str, dots_per_inch: int, width: float | None, quiet: bool
) -> int:
    """Draw SOURCE: a result file, or a scene, which is solved first.

    Without --what it draws the pictures that suit the result. PATH is a folder, a file ending in .png, .svg or .pdf for
    one picture, or one ending in .gif or .mp4 for the animation. The exit code is that of bemkit run.
    """
    with shown_progress(quiet) as callback:
        from bemkit.cli.sources import solved, solved_steps
        from bemkit.pictures.files import ANIMATION, check_place, save_pictures

        if what is None and Path(target).suffix.lower() in (".gif", ".mp4"):
            what = (ANIMATION,)
        reserve(check_place(target, what))
        moves = what is not None and ANIMATION in what
        steps = solved_steps(source, callback) if moves else [solved(source, callback)]
        paths = save_pictures(steps, target, what, dots_per_inch=dots_per_inch, width=width)
    for path in paths if not quiet else ():
        print(path)
    if not steps[-1].is_converged:
        print(f"bemkit: {steps[-1].status.name.lower()}: {steps[-1].message}", file=sys.stderr)
    return exit_code_of(steps[-1])
