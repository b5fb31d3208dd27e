"""The command ``bemkit report``; what it needs is loaded behind its progress bar."""

from __future__ import annotations

import click

from bemkit.cli import options
from bemkit.cli.options import reserve, shown_progress
from bemkit.cli.process import exit_code_of


@click.command()
@click.argument("source")
@click.option(
    "-o", "--output", "target", default="report.html", metavar="FILE", help="Write the page to FILE (report.html)."
)
@click.option("--interactive", is_flag=True, help="A drawing with values under the pointer in place of pictures.")
@options.quiet_option
def report(source: str, target: str, interactive: bool, quiet: bool) -> int:
    """Write a page on SOURCE: a result file, or a scene, which is solved first.

    The page holds summary, pictures, tables, certificate, plan, scene and versions, and needs no other file.
    The exit code is that of bemkit run.
    """
    with shown_progress(quiet) as callback:
        from bemkit.cli.sources import solved
        from bemkit.report.page import check_report, save_report

        reserve([check_report(target, interactive=interactive)])
        solution = solved(source, callback)
        path = save_report(target, solution, interactive=interactive)
    if not quiet:
        print(path)
    return exit_code_of(solution)
