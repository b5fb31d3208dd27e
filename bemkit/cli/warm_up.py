"""The command ``bemkit warm-up``."""

from __future__ import annotations

import time

import click


@click.command("warm-up")
def warm_up() -> None:
    """Compile the kernels of large scenes now, which the first run would do otherwise.

    numba keeps them on disk: this is needed once for an installation. It takes about half a minute.
    """
    from bemkit.cli.options import shown_progress
    from bemkit.operators.hierarchy.warm_up import warm_up as compiled_kernels

    begin = time.perf_counter()
    with shown_progress(False):
        for ready in compiled_kernels():
            how = "kept from before" if ready.was_kept else "compiled"
            click.echo(f"kernels for {ready.what}: {how}, {time.perf_counter() - begin:.1f} s")
            begin = time.perf_counter()
