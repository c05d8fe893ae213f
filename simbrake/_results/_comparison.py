"""What a comparison of two results found: as text for people, as a dict for programs."""

import dataclasses
import math
from collections.abc import Iterable
from typing import Any, NamedTuple

_SHOWN = 12  # rows of each kind in the text


class Change(NamedTuple):
    """One number in both results (`None` where one does not have it): `absolute` is `b − a`, `relative` to its size."""

    name: str
    a: Any
    b: Any
    unit: str
    absolute: float | None
    relative: float | None
    differs: bool


class SeriesChange(NamedTuple):
    """Greatest difference of one column: `relative` to the greatest value of its unit; when (s) and at which label."""

    name: str
    unit: str
    absolute: float | None
    relative: float | None
    time: float | None
    place: str
    differs: bool


class Word(NamedTuple):
    """Something that is no number in both results."""

    name: str
    a: Any
    b: Any


@dataclasses.dataclass(frozen=True)
class Comparison:
    """Two results side by side, `a` and `b`.

    - `scene`: numbers of the scenes that are not the same;  `parts`: classes, counts and words that are not the same
    - `events` in both, `only_a`, `only_b`;  `metrics`, `energies`, `series` of both;  `status`
    - `solver`, `versions`: settings, counts, versions and machine that are not the same; they are not judged
    - `how` the series were compared, and whether they are `judged`
    - `equal`: nothing judged differs by more than `rtol`
    """

    rtol: float
    status: Word
    scene: list[Change]
    parts: list[Word]
    events: list[Change]
    only_a: list[str]
    only_b: list[str]
    metrics: list[Change]
    energies: list[Change]
    series: list[SeriesChange]
    how: str
    judged: bool
    solver: list[Word]
    versions: list[Word]

    @property
    def equal(self) -> bool:
        """Whether scenes and results are the same within the tolerance."""
        rows = [*self.scene, *self.events, *self.metrics, *self.energies, *self.series]
        alone = self.parts or self.only_a or self.only_b
        return not alone and self.status.a == self.status.b and not any(row.differs for row in rows)

    def as_dict(self) -> dict[str, Any]:
        """Plain values of JSON: `null` for what is absent or infinite."""
        found: dict[str, Any] = {"equal": self.equal}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, list):
                value = [
                    row if isinstance(row, str) else {k: _plain(v) for k, v in row._asdict().items()} for row in value
                ]
            elif isinstance(value, Word):
                value = {"a": value.a, "b": value.b}
            found[field.name] = value
        return found

    def __str__(self) -> str:
        lines = [f"{'equal' if self.equal else 'different'}: relative tolerance {self.rtol:g}"]
        if self.status.a != self.status.b:
            lines.append(f"status   {self.status.a} → {self.status.b}")
        lines += _block("parts", (f"{w.name}  {_word(w.a)} → {_word(w.b)}" for w in self.parts))
        lines += _block("scene", map(_row, self.scene))
        lines += _block("only a", self.only_a) + _block("only b", self.only_b)
        moved = [row for row in self.events if row.differs]
        lines += _block("events", map(_row, sorted(moved, key=lambda row: " of lining " in row.name)))
        for name in ("metrics", "energies"):
            lines += _block(name, (_row(row) for row in getattr(self, name) if row.differs))
        rows = [row for row in self.series if row.differs or (not self.judged and row.absolute)]
        rows.sort(key=lambda row: -(math.inf if row.relative is None else row.relative))
        lines += _block("series", map(_series_row, rows))
        lines.append(f"compared {_count(self.events, 'event')}, {_count(self.metrics, 'metric')}, series {self.how}")
        for name in ("solver", "versions"):
            lines += _block(name, (f"{w.name}  {_word(w.a)} → {_word(w.b)}" for w in getattr(self, name)))
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)


def _plain(x: Any) -> Any:
    return None if isinstance(x, float) and not math.isfinite(x) else x


def _count(rows: list[Any], name: str) -> str:
    return f"{len(rows)} {name}{'' if len(rows) == 1 else 's'}"


def _block(name: str, rows: Iterable[str]) -> list[str]:
    """Lines of one kind, the first with its name."""
    texts = list(rows)
    if len(texts) > _SHOWN:
        texts[_SHOWN:] = [f"… and {len(texts) - _SHOWN} more"]
    return [f"{name if i == 0 else '':9}{text}" for i, text in enumerate(texts)]


def _word(x: Any) -> str:
    return "—" if x is None else str(x)


def _number(x: Any) -> str:
    if x is None:
        return "—"
    return f"{len(x)} entries" if isinstance(x, list) else f"{x:.9g}"


def _row(row: Change) -> str:
    unit = f" {row.unit}" if row.unit not in ("", "1") else ""
    text = f"{row.name}  {_number(row.a)} → {_number(row.b)}{unit}"
    if row.absolute is None or not math.isfinite(row.absolute):
        return text
    share = "" if row.relative is None else f", relative {row.relative:.2g}"
    return f"{text}  ({row.absolute:+.3g}{unit}{share})"


def _series_row(row: SeriesChange) -> str:
    if row.absolute is None:
        return f"{row.name}  {row.place}"
    unit = f" {row.unit}" if row.unit not in ("", "1") else ""
    place = f", {row.place}" if row.place else ""
    return f"{row.name}  by at most {row.absolute:.3g}{unit}, relative {row.relative:.2g}, at {row.time:.6g} s{place}"
