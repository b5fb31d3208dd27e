"""Run the command line with `python -m bemkit`."""

from bemkit.cli import main

if __name__ == "__main__":
    main()
