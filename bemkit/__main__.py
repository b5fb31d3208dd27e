"""The entry of the command line, as `bemkit` and as `python -m bemkit`."""

import sys


def main() -> None:
    """Load the command line and run it; Ctrl-C while it loads ends like Ctrl-C later."""
    try:
        from bemkit.cli.main import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write("bemkit: error: interrupted\n")
        sys.exit(130)


if __name__ == "__main__":
    main()
