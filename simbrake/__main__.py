"""Run the `simbrake` command by `python -m simbrake`."""

from ._commands._cli import main

if __name__ == "__main__":
    main()
