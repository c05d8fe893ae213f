"""`python -m simbrake` does what the `simbrake` command does."""

from ._commands._cli import main

if __name__ == "__main__":
    main()
