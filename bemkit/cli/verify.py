"""The command ``bemkit verify``."""

from __future__ import annotations

from functools import partial

import click

from bemkit.cli import options
from bemkit.cli.options import StudyProgress, reserve, study_output
from bemkit.cli.outputs import Outputs, TextFile

MISSED = 1


@click.command()
@click.argument("names", nargs=-1)
@click.option("--quick", is_flag=True, help="Skip the finest resolutions: at most one minute.")
@options.rows_option
@options.json_option
@options.markdown_option
@options.quiet_option
def verify(
    names: tuple[str, ...], quick: bool, output: str | None, json_file: str | None, markdown: str | None, quiet: bool
) -> int:
    """Compare solutions with closed forms and other known answers at several resolutions.

    NAMES choose cases, such as westergaard or 'pin*'; all by default. The exit code is 1 if one is missed.
    """
    with StudyProgress(quiet) as progress:
        from bemkit.studies.verification.records import FILE, Verification
        from bemkit.studies.verification.verification import verify as verify_cases

        rows, table = study_output(output, Verification.as_table)
        texts = TextFile(json_file, Verification.to_json), TextFile(markdown, Verification.to_markdown)
        outputs = Outputs((table, *texts))
        reserve(outputs.check(FILE.check(rows)))
        found = verify_cases(names, quick=quick, run=partial(progress.compute, name="verification"), file=rows)
    outputs.write(found)
    if not quiet and not outputs.uses_stdout:
        from bemkit.cli.printed_verification import print_verification

        print_verification(found)
    return 0 if found.is_met else MISSED
