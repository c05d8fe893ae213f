"""A scene as one C99 file: its whole run, and its `Stepper` under inputs that the
caller holds."""

import functools
import importlib
import itertools
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._base._faults import InputError, Issues, input_error, whole_file
from .._base._packing import pack
from .._base._part import leaves
from .._base._quantity import Quantity, shown
from ..hybrid.arrays import Array, templates
from ..hybrid.system import SKIPPED, unravel
from ..outputs.judgement import REASONS, held_throughout, judge_of_many
from ..outputs.log import FAILURES, STATUS_MESSAGES, Status, status_of
from ..outputs.metrics import HOLDING, metric_names
from ..outputs.probe import probe_of
from ..outputs.quantities import SERIES_COLUMNS, series_of
from ..outputs.torques import ends_driven
from ..parts.scene import Scene
from ..parts.scene_checks import checked
from ..physics.assemble import assemble
from ..physics.mechanism import BandMode, Label, Mode, events_of_change
from ..runs.measure import check_metrics, measure_all, unit_of
from ..runs.simulate import check_limits, method_of, room_for, simulate, solver_of
from ._c_code import HELPERS, Program, UnknownOperation, literal
from .stepper import HeldInput, InputShape, held_inputs, step_of_numbers

#: metrics where the caller names none, as far as a scene has them
_USUAL = ("slip_onset_time", "full_slip_time", "stopping_time")


def export_c(
    scene: Scene,
    path: str | Path,
    *,
    inputs: Sequence[str] | str | None = None,
    outputs: Sequence[str] | str | None = None,
    max_steps: int | None = None,
    waiting: int = 64,
) -> Path:
    """Write a scene as one C99 file without dependencies: its run, and one step under
    held inputs.

    - `inputs`: of the step, as for `Stepper`; by default lever and load, as far as the
      scene can have them. A duty in phases has no step
    - `outputs`: metrics of the run by name; by default `slip_onset_time`,
      `full_slip_time` and `stopping_time`
    - `max_steps`: step attempts of a run; by default what the scene's own run needs and
      a quarter more
    - `waiting`: how many commands can wait in a dead time (a step takes longer with
      more)

    All names in the file begin with its own, here `stop`. `stop_run` takes all numbers
    of the scene and gives metrics, events with their times and, where there is space
    for them, all columns of `Series` at the end of each step; `stop_step` advances a
    `stop_stepper`. Numbers, metrics, events, columns and result codes have names in
    enums, with units. Structure and sizes are those of the scene given, and so are the
    method and the most step attempts.

    Raises `InputError` with all errors of the scene and of the arguments, and for a scene
    with an operation that has no C form yet; `SimulationError` where the scene's own
    run fails.

    Example:
        >>> try:
        ...     sb.export_c(scene, "brake.txt")
        ... except sb.InputError as error:
        ...     print(error.faults[0].hint)
        give a name with .c
    """
    path = Path(path)
    issues = Issues()
    if path.suffix != ".c":
        issues.add(str(path), f"has the ending {path.suffix!r}", "give a name with .c")
    issues.attempt(check_limits, 1e-10, max_steps=max_steps)
    issues.attempt(check_waiting, waiting)
    whole = issues.attempt(checked, scene)
    asked = [outputs] if isinstance(outputs, str) else [*(outputs or ())]
    held = None
    if whole is not None:
        if outputs is None:
            asked = [name for name in _USUAL if name in metric_names(whole)]
        issues.attempt(check_metrics, whole, asked)
        inputs = possible_inputs(whole) if inputs is None else inputs
        held = None if inputs is None else issues.attempt(held_inputs, whole, inputs)
    issues.report()
    assert whole is not None
    text = c_text(Export(c_name(path), whole, held, asked, max_steps, waiting))
    with whole_file(path) as target:
        target.write_text(text, "utf-8")
    return path


def check_waiting(waiting: int) -> None:
    if not isinstance(waiting, int) or not 1 <= waiting <= 10_000:
        raise input_error(
            "waiting",
            f"{shown(waiting)} is out of range",
            "must be a whole number, 1 to 10000",
        )


def c_name(path: Path) -> str:
    """What names in C begin with for a file of this name."""
    name = re.sub(r"\W", "_", path.stem, flags=re.ASCII)
    return f"scene_{name}" if name[:1].isdigit() else name


def c_text(export: "Export", hint: str = "leave out what the export stops at") -> str:
    """The text of a C file; `InputError` with a hint where an operation has no C
    form."""
    try:
        return export.text()
    except UnknownOperation as error:
        what = f"uses the operation {error}, which has no C form yet"
        raise input_error("scene", what, hint) from error


def possible_inputs(scene: Scene) -> list[str] | None:
    """The inputs that a scene can have, `None` where it has no step."""

    def possible(*names: str) -> bool:
        try:
            held_inputs(scene, names)
        except InputError:
            return False
        return True

    return (
        [name for name in ("lever", "load") if possible(name)] if possible() else None
    )


def _labels(modes: Mode) -> Array:
    """The label of each row, (rows, 5); its last entry is whether the load stands on the
    ground, where it can, else whether the rope is taut."""
    *parts, taut, grounded = modes.label
    parts.append(taut if modes.grounded is None else grounded)
    return jnp.stack([jnp.asarray(part, jnp.int32) for part in parts], axis=-1)


def _words(text: str) -> str:
    return text.replace("*/", "* /").replace("\n", " ")


def _about(name: str, about: Any, size: int, more: str) -> str:
    return f"{name} [{about.unit}]: {about.meaning}" + (
        f", {size} {more}" if size > 1 else ""
    )


class Export:
    """The text of a file: programs printed from JAX, and functions around them; without
    `outputs` no whole run."""

    def __init__(
        self,
        name: str,
        scene: Scene,
        held: dict[str, HeldInput] | None,
        outputs: list[str] | None = None,
        max_steps: int | None = None,
        waiting: int = 64,
    ) -> None:
        self.name = name
        self.scene = scene
        self.outputs = outputs or []
        self.rtol = 1e-10
        self.solver = solver_of(scene)
        self.steps = held is not None
        self.held = held or {}
        self.runs = outputs is not None
        self.max_steps = max_steps or (
            room_for(simulate(scene, solver=self.solver)) if self.runs else 0
        )
        self.numbers, self.like = pack(scene.as_run)
        #: numbers by their paths; in place of its values each has their places among
        #: all numbers
        placed = leaves(
            self.like.unpack(np.arange(self.numbers.size, dtype=np.float64))
        )
        self.placed = [leaf for leaf in placed if np.size(leaf.value)]
        problem = jax.eval_shape(
            lambda x: assemble(self.like.unpack(x))[1:], self.numbers
        )
        self.templates = templates(*problem)
        #: points of each input; what is known once the text is made: columns, places of
        #: the inputs in the mode, events
        self.points = {
            key: 2 * waiting + 2 if held.delay else len(held.times)
            for key, held in self.held.items()
        }
        self.columns: dict[str, jax.ShapeDtypeStruct] = {}
        self.pieces: list[int] = []
        self.events: list[str] = []
        self.bytes = 0  # of its memory

    # --- what is printed from JAX

    def _whole(self, x: Array) -> tuple[Array, ...]:
        """Metrics of a run, its counts, and the rows of its record."""
        result = simulate(
            self.like.unpack(x[:-1]),
            solver=self.solver,
            rtol=x[-1],
            max_steps=self.max_steps,
        )
        values = [
            jnp.asarray(value, jnp.float64)
            for value in measure_all(result, self.outputs)
        ]
        record = result.record
        counts = jnp.stack([record.code, record.count, *record.stats]).astype(jnp.int32)
        rows = record.rows
        speeds = jnp.where(
            jnp.arange(rows.t.size, dtype=jnp.int32) <= record.count,
            record.states.omega,
            0.0,
        )
        judged = judge_of_many(record)
        if HOLDING in self.outputs:
            judged = held_throughout(judged, values[self.outputs.index(HOLDING)])
        ratios = jnp.stack([judged.reserve, judged.sliding, judged.pull])
        ending = (
            jnp.any(speeds != 0.0),
            ends_driven(record),
            judged.away,
            judged.steady,
            judged.reason,
            judged.colour,
        )
        flags = jnp.stack([jnp.asarray(flag).astype(jnp.int32) for flag in ending])
        whole = jnp.stack(values) if values else jnp.zeros(1)
        return (
            whole,
            counts,
            rows.t,
            rows.y,
            rows.mode,
            rows.kind,
            _labels(record.modes),
            flags,
            ratios,
        )

    def _columns(
        self, system: Any, t: Array, y: Array, mode: Array, templates: tuple[Any, Any]
    ) -> Array:
        state, modes = jax.vmap(
            lambda y, mode: (unravel(y, templates[0]), unravel(mode, templates[1]))
        )(y[None], mode[None])
        series = series_of(probe_of(system, t[None], state, modes), system)
        columns = {name: getattr(series, name) for name in SERIES_COLUMNS}
        columns = {
            name: jnp.asarray(column)
            for name, column in columns.items()
            if column is not None
        }
        self.columns = {
            name: jax.ShapeDtypeStruct(column.shape, column.dtype)
            for name, column in columns.items()
        }
        return jnp.concatenate(
            [jnp.ravel(column).astype(jnp.float64) for column in columns.values()]
        )

    def _seen(self, x: Array, t: Array, y: Array, mode: Array) -> Array:
        """Columns at one instant of the run."""
        return self._columns(
            assemble(self.like.unpack(x))[0], t, y, mode, self.templates
        )

    def _begun(self, x: Array) -> Array:
        """Time of the start; of each input its first value, a time long past, and its
        lag (0: none)."""
        scene = self.like.unpack(x)
        start = jnp.asarray(scene.initial.time)
        numbers = []
        for held in self.held.values():
            parent = functools.reduce(getattr, held.where[:-1], scene)
            part = getattr(parent, held.where[-1])
            delay = getattr(parent, "dead_time", 0.0)
            lag = 0.0 if held.lag is None else parent.lag
            numbers += [
                part.value(start - delay, part.first_piece(start - delay)),
                start - delay - 1.0,
                lag,
            ]
        return jnp.stack([start, *numbers])

    def _step(self) -> tuple[Program, int, tuple[int, int]]:
        shapes = tuple(
            InputShape(key, held.where, self.points[key])
            for key, held in self.held.items()
        )
        limits = np.asarray(self.rtol), np.asarray(np.inf), np.asarray(10_000, np.int32)
        _, packing = pack((self.scene, *limits))
        run, before, sizes = step_of_numbers(
            packing, method_of(self.scene, self.solver), shapes
        )

        def step(x: Array) -> tuple[Array, ...]:
            record = run(x)
            n = record.count
            rows = record.rows
            counts = jnp.stack([record.code, n]).astype(jnp.int32)
            places = unravel(np.arange(sizes[1]), record.mode_like).pieces
            self.pieces = [int(places[key]) for key in self.held]
            now = rows.t[n], rows.y[n], rows.mode[n]
            columns = self._columns(
                record.system, *now, (record.y_like, record.mode_like)
            )
            return counts, rows.t, _labels(record.modes), *now[1:], columns

        return (
            Program(f"{self.name}_part", step, np.ones(before + 2 + sum(sizes))),
            before,
            sizes,
        )

    def places(self) -> dict[str, tuple[int, int]]:
        """First entry and number of entries of each column."""
        sizes = [column.size for column in self.columns.values()]
        starts = itertools.accumulate(sizes, initial=0)
        return {
            name: (start, size)
            for name, start, size in zip(self.columns, starts, sizes, strict=False)
        }

    @property
    def width(self) -> int:
        """Entries of all columns."""
        return sum(column.size for column in self.columns.values())

    # --- events

    def _changes(self) -> tuple[list[str], dict[str, Any]]:
        """Names of events, and tables by which C finds those of a change of mode."""
        system = assemble(self.scene)[0]
        mode: Mode = self.templates[1]
        kinds = [
            [int(band) for band in BandMode],
            [0, 1] if self.scene.brake.in_series else [0],
            [-1, 0, 1] if mode.turn is not None else [1],
            [1] if mode.taut is None and mode.grounded is None else [0, 1],
        ]
        states = [*itertools.product(*kinds)]

        def label(state: tuple[int, ...], layer: int = 0) -> Label:
            band, inner, turn, last = state
            if mode.grounded is None:
                return Label(band, inner, turn, layer, last)
            return Label(band, inner, turn, layer, grounded=last)

        endings = [
            [*Status].index(
                status_of(label(state), moved, driven, lambda: away, lambda: steady)
            )
            for state in states
            for moved, driven, away, steady in itertools.product(
                (False, True), repeat=4
            )
        ]
        resting = ", ".join(str(int(label(state).rests)) for state in states)
        names = list[str]()
        sequences: list[tuple[int, ...]] = [()]
        table = list[int]()
        for before, after, layer, first in itertools.product(
            states, states, (0, 1), (False, True)
        ):
            was = label(before)
            now = label(after, layer)
            events = (
                events_of_change(was, now, first, system.rests_open)
                if was != now
                else []
            )
            names += [event for event in events if event not in names]
            sequence = tuple(names.index(event) + 1 for event in events)
            if sequence not in sequences:
                sequences.append(sequence)
            table.append(sequences.index(sequence))
        most = max(map(len, sequences)) + 1
        rows = ", ".join(
            "{" + ", ".join(map(str, [*sequence, 0][:most])) + "}"
            for sequence in sequences
        )
        place = "l[0]"
        for entry, kind in ((1, kinds[1]), (2, kinds[2]), (4, kinds[3])):
            of_kind = f"l[{entry}] + 1" if len(kind) == 3 else f"(l[{entry}] != 0)"
            place = f"({place}) * {len(kind)} + {of_kind}" if len(kind) > 1 else place
        numbers, endings = (
            "\n".join(
                "  " + ", ".join(map(str, each[i : i + 40])) + ","
                for i in range(0, len(each), 40)
            )
            for each in (table, endings)
        )
        tables = {
            "sequences": rows,
            "longest": most,
            "changes": numbers,
            "endings": endings,
            "resting": resting,
        }
        return names, tables | {"place": place, "states": len(states)}

    # --- the file

    def _enums(
        self, codes: list[tuple[str, int, str]], states: int
    ) -> dict[str, list[tuple[str, int, str]]]:
        """What has a number: names, numbers and meanings, by the name of their enum."""
        sizes = [("NUMBERS", self.numbers.size, "numbers of the scene")]
        sizes += [("METRICS", len(self.outputs), "metrics")] * self.runs
        sizes += [
            ("COLUMNS", self.width, "entries of all columns"),
            ("INPUTS", len(self.held), "inputs of the step"),
        ]
        sizes += [("STATES", states, "states")] * self.steps
        sizes += [("ROWS", self.max_steps + 1, "rows that a run may fill")] * self.runs
        enums = {
            "number": [
                (
                    f"NUMBER_{leaf.path}",
                    int(np.min(leaf.value)),
                    _about(
                        leaf.path, leaf.about, np.size(leaf.value), "numbers from here"
                    ),
                )
                for leaf in self.placed
            ],
            "metric": [
                (f"METRIC_{m}", i, f"[{unit_of(m)}]; infinite: never")
                for i, m in enumerate(self.outputs)
            ],
            "event_name": [
                (f"EVENT_{event}", i, event) for i, event in enumerate(self.events, 1)
            ],
            "column": [
                (
                    f"COLUMN_{key}",
                    start,
                    _about(key, SERIES_COLUMNS[key], size, "of them"),
                )
                for key, (start, size) in self.places().items()
            ],
            "input": [
                (f"INPUT_{key}", i, f"[{held.unit}]")
                for i, (key, held) in enumerate(self.held.items())
            ],
            "code": codes,
            "status": [
                (f"STATUS_{s}", i, STATUS_MESSAGES[s]) for i, s in enumerate(Status)
            ]
            * self.runs,
            "reason": [(f"REASON_{r.id}", i, r.words) for i, r in enumerate(REASONS)]
            * self.runs,
            "size": sizes,
        }
        return {
            what: [
                (re.sub(r"[^A-Z0-9]+", "_", key.upper()).strip("_"), i, _words(about))
                for key, i, about in entries
            ]
            for what, entries in enums.items()
            if entries
        }

    def text(self) -> str:
        import jinja2  # (slow to import)

        name = self.name
        upper = name.upper()
        count = self.numbers.size
        programs = dict[str, Program]()
        about: dict[str, Any] = {"runs": self.runs, "steps": self.steps}
        room = list[str]()
        states = 0
        if self.steps:
            step, before, (states, modes) = self._step()
            programs |= {
                "begun": Program(f"{name}_begun", self._begun, self.numbers),
                "part": step,
            }
            about |= {"ny": states, "nm": modes, **self._about_inputs()}
            room.append(f"double part_in[{before + 2 + states + modes}];")
        if self.runs:
            now = [
                np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(like)])
                for like in self.templates
            ]
            programs["whole"] = Program(
                f"{name}_whole", self._whole, np.append(self.numbers, self.rtol)
            )
            inputs = self.numbers, np.asarray(0.0), now[0], now[1].astype(np.int32)
            programs["seen"] = Program(f"{name}_seen", self._seen, *inputs)
            about |= {"run_ny": now[0].size, "run_nm": now[1].size}
            room.append(f"double whole_in[{count + 1}];")
        self.bytes = sum(program.bytes for program in programs.values())
        self.events, changes = self._changes()
        codes = [("CODE_COMPLETED", 0, "the run reached its end")]
        codes += [
            (f"CODE_{key}", int(code), what)
            for code, (key, what, _) in FAILURES.items()
        ]
        codes += [
            (
                "CODE_BAD_NUMBER",
                -1,
                "a number, a time or an input is not finite, or out of range",
            ),
            ("CODE_NO_MEMORY", -2, "there is no memory"),
            (
                "CODE_TOO_MANY_COMMANDS",
                -3,
                "more commands than there is space for wait in a dead time",
            ),
        ]
        code_names = {
            number: key.removeprefix("CODE_").lower() for key, number, _ in codes
        }
        main = (
            f";\n   with {upper}_MAIN it has a main() that runs the scene and prints "
            "metrics and events"
        ) * self.runs

        def result(key: str) -> Callable[[int], str]:
            """C of a result of a program, whose frame has the name `key` in the working
            memory."""
            return lambda i: f"memory->{key}.{programs[key].outs[i].name}"

        def give(key: str, i: int, value: str) -> str:
            """C that points an argument of a program at a value."""
            argument = programs[key].ins[i].replace("frame->", f"memory->{key}.")
            return f"{argument} = {value};"

        text = Path(__file__).with_name("scene.c").read_text("utf-8")
        text = re.sub(
            r"\b(scene|SCENE)_",
            lambda found: f"{name if found[1] == 'scene' else upper}_",
            text,
        )
        environment = jinja2.Environment(
            variable_start_string="@",
            variable_end_string="@",
            line_statement_prefix="//%",
            undefined=jinja2.StrictUndefined,
            keep_trailing_newline=True,
        )
        return environment.from_string(text).render(
            **{key: result(key) for key in programs},
            **about,
            **changes,
            give=give,
            strings=lambda texts: ", ".join(f'"{text}"' for text in texts),
            name=name,
            kind=_words(self.scene.brake.kind),
            version=program_version(),
            heading_of_main=main,
            enums=self._enums(codes, states),
            helpers=HELPERS,
            programs=programs,
            room=" ".join(room),
            count=count,
            ranges=self._ranges(),
            width=self.width,
            held=len(self.held),
            metrics=self.outputs,
            statuses=[*Status],
            reasons=[reason.id for reason in REASONS],
            event_names=["", *self.events],
            code_names=[
                code_names.get(number, "") for number in range(max(code_names) + 1)
            ],
            values=", ".join(literal(v, "double") for v in self.numbers),
            rtol=repr(self.rtol),
            skipped=SKIPPED,
        )

    def _ranges(self) -> str:
        """Of the numbers of each path where they begin, how many, and what they may
        be."""
        rows = [
            (int(np.min(leaf.value)), np.size(leaf.value), *range_of(leaf.about))
            for leaf in self.placed
        ]
        return ", ".join(
            f"{{{first}, {size}, {low!r}, {high!r}}}" for first, size, low, high in rows
        )

    def _about_inputs(self) -> dict[str, Any]:
        """Of each input: its points, its place in the mode, how many points a command
        needs, what it may be."""
        held = list(self.held.values())
        return {
            "points": [self.points[key] for key in self.held] or [1],
            "places": ", ".join(map(str, self.pieces)) or "0",
            "least": ", ".join("2" if h.lag is None else "4" for h in held) or "2",
            "positive": ", ".join("1" if h.unit == "N" else "0" for h in held) or "0",
            "prompt": ", ".join(
                "0" if h.delay or h.lag is not None else "1" for h in held
            )
            or "0",
        }


def range_of(about: Quantity) -> tuple[float, float]:
    """Lowest and highest value that a number may have."""
    low, high = about.ends
    return math.nextafter(low, math.inf) if about.open_low else low, high


def program_version() -> str:
    return importlib.import_module("simbrake").__version__
