"""What needs a machine that is not always there: the values last measured, with their dates, in `elsewhere.csv`.

A part that measures one of them gives targets whose names begin alike, and the file is brought up to date with the one
that is farthest from its limit.
"""

import csv
import datetime
import pathlib
from typing import Any

from benchmarks.parts.table import Column, Part, Target

NAME = "elsewhere"
TITLE = "last measured on machines with more cores or an accelerator"
_FILE = pathlib.Path(__file__).with_name("elsewhere.csv")
_MOST, _LEAST = "<=", ">="

COLUMNS = (
    Column("what", ""),
    Column("error", "error", ".1e"),
    Column("reached", "reached", ".3g"),
    Column("limit", "wanted"),
    Column("date", "on"),
    Column("machine", "by"),
)


def kept(file: pathlib.Path = _FILE) -> dict[str, dict[str, str]]:
    """Rows of the file by name."""
    with file.open(encoding="utf-8", newline="") as lines:
        return {row["what"]: row for row in csv.DictReader(lines)}


def keep(targets: list[Target], machine: str, file: pathlib.Path = _FILE) -> None:
    """Replaces rows that were measured just now."""
    rows = kept(file)
    now = {what: [t for t in targets if t.what.startswith(what)] for what in rows}
    now = {what: max(found, key=lambda target: target.share) for what, found in now.items() if found}
    for what, target in now.items():
        measured = {"sense": _LEAST if target.least else _MOST, "wanted": f"{target.wanted:g}", "machine": machine}
        measured |= {"reached": f"{target.reached:.4g}", "date": datetime.date.today().isoformat()}
        rows[what] |= measured | {"error": "" if target.error is None else f"{target.error:.1e}"}
    if now:
        with file.open("w", encoding="utf-8", newline="") as lines:
            writer = csv.DictWriter(lines, next(iter(rows.values())), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows.values())


def measure(quick: bool, file: pathlib.Path = _FILE) -> Part:
    """What the file tells; nothing is measured."""
    rows: list[dict[str, Any]] = []
    targets = []
    for what, row in kept(file).items():
        least, error = row["sense"] == _LEAST, float(row["error"]) if row["error"] else None
        target = Target(what, float(row["wanted"]), float(row["reached"]), least, error)
        limit = f"{'≥' if least else '≤'} {target.wanted:g}"
        rows.append(
            {
                "what": what,
                "error": error,
                "reached": target.reached,
                "limit": limit,
                "date": row["date"],
                "machine": row["machine"],
            }
        )
        targets.append(target)
    return Part(NAME, TITLE, COLUMNS, rows, targets, ["measured anew where a part finds such a machine"])
