"""What a part of the cost benchmark gives, and how it is printed."""

import math
from typing import Any, NamedTuple


class Column(NamedTuple):
    """One column: key in the rows, heading, format of its numbers, factor on them."""

    key: str
    head: str
    form: str = ""
    factor: float = 1.0

    def cell(self, row: dict[str, Any]) -> str:
        value = row.get(self.key)
        if value is None:
            return ""
        return str(value) if isinstance(value, str) else format(value * self.factor, self.form)


class Target(NamedTuple):
    """What is wanted of a cost: at most `wanted`, or at least, where `least` is set; `error` of what was computed."""

    what: str
    wanted: float
    reached: float
    least: bool = False
    error: float | None = None

    @property
    def met(self) -> bool:
        return self.reached >= self.wanted if self.least else self.reached <= self.wanted

    @property
    def share(self) -> float:
        """How much of what is allowed is used up: at most 1 where the target is met."""
        return self.wanted / self.reached if self.least else self.reached / self.wanted


class Part(NamedTuple):
    """Measured rows, how to print them, and what was wanted."""

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: list[dict[str, Any]]
    targets: list[Target]
    notes: list[str]

    def as_numbers(self) -> dict[str, Any]:
        """Everything for a JSON file."""
        targets = [target._asdict() | {"met": target.met} for target in self.targets]
        return {"title": self.title, "rows": self.rows, "targets": targets, "notes": self.notes}


def _cells(part: Part) -> list[list[str]]:
    return [[column.cell(row) for column in part.columns] for row in part.rows]


def text(part: Part) -> str:
    """The part for a terminal."""
    table = [[column.head for column in part.columns], *_cells(part)]
    widths = [max(len(line[i]) for line in table) for i in range(len(part.columns))]
    lines = [f"\n{part.name}: {part.title}"]
    for line in table:
        first = line[0].ljust(widths[0])
        lines.append("  ".join([first, *(cell.rjust(w) for cell, w in zip(line[1:], widths[1:], strict=True))]))
    lines += [f"  {note}" for note in part.notes]
    return "\n".join([*lines, *(f"  {line}" for line in wanted(part))])


def wanted(part: Part) -> list[str]:
    """A line for each target."""
    return [line_of(target) for target in part.targets]


def line_of(target: Target) -> str:
    """What was reached beside its limit and its error."""
    limit = f"wanted {'≥' if target.least else '≤'} {target.wanted:g}"
    error = "" if target.error is None else f", error {target.error:.1e}"
    return f"{'reached' if target.met else 'MISSED '} {target.what}: {target.reached:.4g}, {limit}{error}"


def markdown(part: Part) -> str:
    """The part for the documentation."""
    lines = [f"**{part.name}**: {part.title}", ""]
    lines.append("| " + " | ".join(column.head or " " for column in part.columns) + " |")
    lines.append("|" + "---|" * len(part.columns))
    lines += ["| " + " | ".join(cells) + " |" for cells in _cells(part)]
    if part.notes:
        lines += ["", " ".join(f"{note}." for note in part.notes)]
    if part.targets:
        lines += ["", "| wanted | limit | reached | error | |", "|---|---|---|---|---|"]
    for t in part.targets:
        limit = f"{'≥' if t.least else '≤'} {t.wanted:,g}"
        error = "" if t.error is None else f"{t.error:.1e}"
        lines.append(f"| {t.what} | {limit} | {number(t.reached)} | {error} | {'yes' if t.met else '**missed**'} |")
    return "\n".join(lines)


def number(x: float) -> str:
    """Three digits, without an exponent up to a million."""
    if not math.isfinite(x) or x == 0:
        return str(x)
    digits = max(0, 2 - math.floor(math.log10(abs(x))))
    return f"{x:,.{digits}f}" if 1e-3 <= abs(x) < 1e7 else f"{x:.2e}"
