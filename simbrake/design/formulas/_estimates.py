"""Estimates beside the simulated values: one row, tables of rows, and the estimates of
a scene or a run."""

from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

from ..._base._faults import InputError, input_error
from ..._base._table import Column, Table, Tabular, frozen, plain
from ...parts.scene import Scene, banded_brake
from ...parts.scene_checks import check_scene
from ...runs.result import Result, require_one
from ._braking import Braking
from ._heated import run_values
from ._rows import (
    EstimateRow,
    power_rows,
    present,
    rows_of_pair,
    shown,
    stage_rows,
    stop_rows,
    unit_text,
)
from .inputs import EstimateData, Input, settle
from .statics import classical_staged_stop, classical_stop


@frozen
class RowTable(Tabular):
    """Named rows, their inputs, and a description of the brake application
    (`about`)."""

    about: str
    inputs: tuple[Input, ...]
    rows: tuple[EstimateRow, ...]
    kind: ClassVar[str] = "row"

    def __getitem__(self, name: str) -> EstimateRow:
        """The row of that name. Raises `KeyError` with the known names."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(
            f"no {self.kind} {name!r}; there are: {', '.join(row.name for row in self.rows)}"
        )

    def __iter__(self) -> Iterator[EstimateRow]:
        return iter(self.rows)

    def as_list(self) -> list[dict[str, Any]]:
        """Return every row as numbers and text; numbers that are not finite are
        `None`."""
        return [row.as_dict() for row in self.rows]

    def head(self) -> list[str | Table]:
        """Description of the brake application, and the inputs."""
        columns = (
            "name",
            Column(
                "value", show=lambda x: f"{x:.5g}" if isinstance(x, float | int) else ""
            ),
            Column("unit", left=True, show=unit_text),
        )
        inputs = Table([*columns, "source"], self.inputs, "inputs and assumptions")
        return [self.about, "", inputs]


#: columns of rows of a synthesis, with their headings
_OF_STEPS = {"verdict": "", "numbers": "with"}


def table_of(rows: Sequence[EstimateRow]) -> list[str | Table]:
    """Rows as a table, those of a synthesis with their numbers, and below it why
    estimate and run differ."""
    columns = [
        ("name", ""),
        *(Column(name, show=shown) for name in ("estimate", "simulated", "difference")),
        *(Column(name, left=True, show=unit_text) for name in ("unit", "formula")),
    ]
    columns += [
        Column(name, heading=heading, left=True, hidden=not rows[0].step)
        for name, heading in _OF_STEPS.items()
    ]
    lines = []
    for row in rows:
        formula = f"{row.formula} ({row.source})" if row.source else row.formula
        line = row.name, row.value, row.simulated, row.difference, row.unit, formula
        lines.append([*line, row.verdict, ", ".join(map(str, row.numbers))])
    reasons: dict[str, list[str]] = {}
    for row in rows:
        if row.why and row.difference:
            reasons.setdefault(row.why, []).append(row.name)
    return [
        Table(columns, lines),
        *(f"reason: {why} ({'; '.join(names)})" for why, names in reasons.items()),
    ]


# --- the estimates ------------------------------------------------------------------


@frozen
class EngineeringEstimates(RowTable):
    """Classical estimates of a brake from its scene, beside its simulation where there
    is one.

    - `rows`: the estimates in order; `inputs`: their inputs and the source of each
      number; `about`: the brake application that they are of
    - `estimates["stopping time"]` is one row; `str` gives the table, `as_dict` the same
      as numbers and words

    Example:
        >>> table = sb.estimates(scene)
        >>> round(table["stopping time"].value, 3)
        1.258
    """

    kind: ClassVar[str] = "estimate"

    def parts(self) -> list[str | Table]:
        return [*self.head(), "", *table_of(self.rows)]

    def as_dict(self) -> dict[str, Any]:
        """Return the data as numbers, lists and text; numbers that are not finite are
        `None`."""
        return {
            "about": self.about,
            "inputs": plain(self.inputs),
            "estimates": self.as_list(),
        }


def no_stop(hint: str) -> InputError:
    """Error of a scene without a classical stop where one is needed."""
    hint = f"it must begin in motion and the brake outweigh its load; or {hint}"
    return input_error("scene", "has no classical stop", hint)


def braking_of(run: Scene | Result, data: EstimateData | None) -> tuple[Braking, str]:
    """The brake application of a scene or of a run, with its description. Raises
    `InputError` as `estimates`."""
    scene = require_one(run).scene if isinstance(run, Result) else run
    check_scene(scene)
    banded_brake(scene)
    inputs = settle(scene, data)
    staged = scene.brake.in_series
    stop = None if staged else classical_stop(scene)
    stages = classical_staged_stop(scene) if staged else None
    if not isinstance(run, Result):
        if stop is None and stages is None:
            raise no_stop("simulate it and give the result")
        return Braking.of(
            scene, inputs, stop, stages
        ), "; time and friction work are those of a classical stop"
    values = run_values(run)
    if values is None:
        raise input_error("run", "has no friction work", "no lining slides in it")
    which = (
        "the brake application"
        if values.brakings == 1
        else f"the hardest of {values.brakings} stretches of sliding"
    )
    about = (
        f" beside the simulation; time and friction work are those of {which} "
        f"from {values.t[0]:.6g} s to {values.t[-1]:.6g} s"
    )
    return Braking.of(scene, inputs, stop, stages, values), about


def estimates(
    run: Scene | Result, data: EstimateData | None = None
) -> EngineeringEstimates:
    """Classical estimates of a brake application from its scene, beside its simulation
    (model §6.3).

    - `run`: a `Scene`, from which a classical stop gives time and friction work (all
      linings slide from the first moment under the maximum lever tension); or a
      `Result`: time and work are then those of its hardest brake application, and every
      estimate is shown beside the simulated number where the run has one
    - `data`: numbers that the scene does not have, or that replace them; missing ones
      are taken from the papers or assumed, and the report states the source of each

    Rows: stop and friction power with its shares (S-7…11), thermal penetration depth,
    Fourier numbers and effective volumes (S-15, steps 1–3), partition (S-41, Charron),
    bulk, surface, flash and maximum temperatures (S-25…28), real contact and surfaces
    (S-34…38), heat balance over four revolutions (S-17…21), thermal stress of the rim.

    Of several alike rims slack tension, tight tension and their ratio are those of each
    band; torque, works, areas and heat are those of all together.

    Of a staged brake: its stages and the friction work of both pairs (after K), then
    the rows above for each pair, band and linings (`…, external pair`) and linings and
    rim (`…, internal pair`); balance and thermal stress are of the rim alone.

    Raises `InputError` for a scene with input errors, for a scene alone that has no
    classical stop (at rest at the start, a lever that holds the speed, a load that
    outweighs the brake, a self-locking lining), for a run in which nothing slides, and
    a traced or batched one.

    Example:
        >>> type(sb.estimates(scene)).__name__
        'EngineeringEstimates'
    """
    b, about = braking_of(run, data)
    if b.scene.brake.in_series:
        rows = [*stage_rows(b), *power_rows(b)]
        for pair in b.of_pairs():
            rows += [
                row._replace(name=f"{row.name}, {pair.pair} pair")
                for row in rows_of_pair(pair)
            ]
    else:
        simulated = (None, None, None)
        if b.run is not None:
            metrics = b.run.result.metrics
            simulated = (
                metrics.get("stopping_time"),
                metrics.get("stopping_angle"),
                b.run.total_work,
            )
        rows = [*stop_rows(b, *simulated), *power_rows(b), *rows_of_pair(b)]
    return EngineeringEstimates(
        f"engineering estimates{about}", tuple(b.inputs.values()), tuple(present(rows))
    )
