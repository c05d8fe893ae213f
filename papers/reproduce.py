"""Recompute the tables of the papers cell by cell: printed, computed, difference,
verdict.

    python papers/reproduce.py [--json] [--out FOLDER]

Printed inputs and numbers that cannot differ are shown and counted as given and
trivial, not as agreement. `--json` prints a list of {table, row, column, printed,
computed, verdict, kind}; `--out` draws the papers' figures and tables that a formula
gives, with the printed numbers as points. Exit code 1 where a cell disagrees.
"""

import argparse
import json
import pathlib
import sys

HERE = pathlib.Path(__file__).parent


def main(arguments: list[str] | None = None) -> int:
    """Print the comparison; the exit code."""
    parser = argparse.ArgumentParser(
        description="Recompute the tables of the papers cell by cell."
    )
    parser.add_argument(
        "--json",
        action="store_true",
        help="print a list of cells as JSON, alone on stdout",
    )
    parser.add_argument("--out", type=pathlib.Path, help="folder for the figures")
    options = parser.parse_args(arguments)
    from printed_tables import DISAGREES, cells, report

    rows = cells()
    print(
        json.dumps([cell.as_dict() for cell in rows], indent=1)
        if options.json
        else report(rows)
    )
    if options.out is not None:
        from paper_figures import write

        names = ", ".join(map(str, write(options.out)))
        print(f"written  {names}", file=sys.stderr if options.json else sys.stdout)
    return int(any(cell.verdict == DISAGREES for cell in rows))


if __name__ == "__main__":
    sys.exit(main())
