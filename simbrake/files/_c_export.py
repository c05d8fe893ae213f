"""A scene as one C99 file: its whole run, and its `Stepper` under inputs that the caller holds."""

import functools
import importlib
import itertools
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._base._arguments import explained
from .._base._compiling import pack
from .._base._faults import Fault, InputError, whole_file
from .._base._part import leaves
from .._base._quantity import shown
from .._outputs._log import FAILURES, STATUS_MESSAGES, Status, status_of
from .._outputs._metrics import metric_names
from .._outputs._probe import ends_driven, lowers_steadily, runs_away, seen_at
from .._outputs._quantities import SERIES_COLUMNS, series_of
from .._parts._scene import Scene, checked
from .._physics._assemble import assemble
from .._physics._mechanism import BandMode, Label, Mode, events_of_change
from .._run._measure import check_metrics, measure, unit_of
from .._run._simulate import check_limits, method_of, room_for, simulate, solver_of
from .._run._stepper import HeldInput, InputShape, held_inputs, input_piece, step_of_numbers
from ..hybrid._arrays import Array
from ..hybrid._solve import likes
from ..hybrid._system import SKIPPED, unravel
from ._c_code import HELPERS, Program, UnknownOperation, literal

#: metrics where the caller names none, as far as a scene has them
_USUAL = ("slip_onset_time", "full_slip_time", "stopping_time")


@explained
def export_c(
    scene: Scene,
    path: str | Path,
    *,
    inputs: Sequence[str] | str | None = None,
    outputs: Sequence[str] | str | None = None,
    max_steps: int | None = None,
    waiting: int = 64,
) -> Path:
    """Write a scene as one C99 file without dependencies: its run, and one step under held inputs.

    - `inputs`: of the step, as for `Stepper`; by default lever and load, as far as the scene can have them. A duty in
      phases has no step
    - `outputs`: metrics of the run by name; by default `slip_onset_time`, `full_slip_time` and `stopping_time`
    - `max_steps`: step attempts of a run; by default what the scene's own run needs and a quarter more
    - `waiting`: how many commands can wait in a dead time (a step takes longer with more)

    All names in the file begin with its own, here `stop`. `stop_run` takes all numbers of the scene and gives metrics,
    events with their times and, where there is space for them, all columns of `Series` at the end of each step;
    `stop_step` advances a `stop_stepper`. Numbers, metrics, events, columns and result codes have names in enums, with
    units. Structure and sizes are those of the scene given, and so are the method and the most step attempts.

    Raises `InputError` for errors of the scene, unknown inputs and metrics, and a scene with an operation that has no C
    form yet; `SimulationError` where the scene's own run fails.

    Example:
        >>> try:
        ...     sb.export_c(scene, "brake.txt")
        ... except sb.InputError as error:
        ...     print(error.faults[0].hint)
        give a name with .c
    """
    path = Path(path)
    if path.suffix != ".c":
        raise InputError([Fault(str(path), f"has the ending {path.suffix!r}", "give a name with .c")])
    scene = checked(scene)
    check_limits(1e-10, max_steps=max_steps)
    check_waiting(waiting)
    inputs = possible_inputs(scene) if inputs is None else inputs
    if outputs is None:
        outputs = [name for name in _USUAL if name in metric_names(scene)]
    outputs = [outputs] if isinstance(outputs, str) else [*outputs]
    check_metrics(scene, outputs)
    held = None if inputs is None else held_inputs(scene, inputs)
    text = printed(Export(c_name(path), scene, held, outputs, max_steps, waiting))
    with whole_file(path) as target:
        target.write_text(text, "utf-8")
    return path


def check_waiting(waiting: int) -> None:
    if not isinstance(waiting, int) or not 1 <= waiting <= 10_000:
        raise InputError([Fault("waiting", f"{shown(waiting)} is out of range", "must be a whole number, 1 to 10000")])


def c_name(path: Path) -> str:
    """What names in C begin with for a file of this name."""
    name = re.sub(r"\W", "_", path.stem, flags=re.ASCII)
    return f"scene_{name}" if name[:1].isdigit() else name


def printed(export: "Export") -> str:
    """The text of a C file; `InputError` where an operation has no C form."""
    try:
        return export.text()
    except UnknownOperation as error:
        what = f"uses the operation {error}, which has no C form yet"
        raise InputError([Fault("scene", what, "leave out what the export stops at")]) from error


def possible_inputs(scene: Scene) -> list[str] | None:
    """The inputs that a scene can have, `None` where it has no step."""

    def possible(*names: str) -> bool:
        try:
            held_inputs(scene, names)
        except InputError:
            return False
        return True

    return [name for name in ("lever", "load") if possible(name)] if possible() else None


def _labels(modes: Mode) -> Array:
    """The label of each row, (rows, 5)."""
    return jnp.stack([jnp.asarray(part, jnp.int32) for part in modes.label], axis=-1)


def _words(text: str) -> str:
    return text.replace("*/", "* /").replace("\n", " ")


def _out(program: Program, key: str, i: int) -> str:
    """C of a result of a program, whose frame has the name `key` in the working memory."""
    return f"memory->{key}.{program.outs[i].name}"


def _given(program: Program, key: str, i: int, value: str) -> str:
    """C that points an argument of a program at a value."""
    return f"{program.ins[i].replace('frame->', f'memory->{key}.')} = {value};"


class Export:
    """The text of a file: programs printed from JAX, and functions around them; without `outputs` no whole run."""

    def __init__(
        self,
        name: str,
        scene: Scene,
        held: dict[str, HeldInput] | None,
        outputs: list[str] | None = None,
        max_steps: int | None = None,
        waiting: int = 64,
    ) -> None:
        self.name, self.upper, self.scene, self.outputs, self.rtol = name, name.upper(), scene, outputs or [], 1e-10
        self.solver, self.steps, self.held = solver_of(scene), held is not None, held or {}
        self.runs = outputs is not None
        self.max_steps = max_steps or (room_for(simulate(scene, solver=self.solver)) if self.runs else 0)
        self.numbers, self.like = pack(scene.as_run)
        problem = jax.eval_shape(lambda x: assemble(self.like.unpack(x))[1:], self.numbers)
        self.likes = likes(*problem)
        #: points of each input; what is known once the text is made: columns, places of the inputs in the mode, events
        self.points = {key: 2 * waiting + 2 if one.delay else len(one.times) for key, one in self.held.items()}
        self.columns: dict[str, jax.ShapeDtypeStruct] = {}
        self.pieces: list[int] = []
        self.events: list[str] = []
        self.bytes = 0  # of its memory

    # --- what is printed from JAX

    def _whole(self, x: Array) -> tuple[Array, ...]:
        """Metrics of a run, its counts, and the rows of its record."""
        result = simulate(self.like.unpack(x[:-1]), solver=self.solver, rtol=x[-1], max_steps=self.max_steps)
        values = [jnp.asarray(measure(result, metric), jnp.float64) for metric in self.outputs]
        record = result.record
        counts = jnp.stack([record.code, record.count, *record.stats]).astype(jnp.int32)
        rows = record.rows
        speeds = jnp.where(jnp.arange(rows.t.size, dtype=jnp.int32) <= record.count, rows.y[:, 1], 0.0)
        ending = jnp.any(speeds != 0.0), ends_driven(record), runs_away(record), lowers_steadily(record)
        flags = jnp.stack([jnp.asarray(flag).astype(jnp.int32) for flag in ending])
        whole = jnp.stack(values) if values else jnp.zeros(1)
        return whole, counts, rows.t, rows.y, rows.mode, rows.kind, _labels(record.modes), flags

    def _columns(self, system: Any, t: Array, y: Array, mode: Array, likes: tuple[Any, Any]) -> Array:
        state, modes = jax.vmap(lambda y, mode: (unravel(y, likes[0]), unravel(mode, likes[1])))(y[None], mode[None])
        series = series_of(seen_at(system, t[None], state, modes), system)
        columns = {name: getattr(series, name) for name in SERIES_COLUMNS}
        columns = {name: jnp.asarray(column) for name, column in columns.items() if column is not None}
        self.columns = {name: jax.ShapeDtypeStruct(column.shape, column.dtype) for name, column in columns.items()}
        return jnp.concatenate([jnp.ravel(column).astype(jnp.float64) for column in columns.values()])

    def _seen(self, x: Array, t: Array, y: Array, mode: Array) -> Array:
        """Columns at one instant of the run."""
        return self._columns(assemble(self.like.unpack(x))[0], t, y, mode, self.likes)

    def _begun(self, x: Array) -> Array:
        """Time of the start; of each input its first value, a time long past, and its lag (0: none)."""
        scene = self.like.unpack(x)
        start, numbers = jnp.asarray(scene.initial.time), []
        for held in self.held.values():
            parent, part = (functools.reduce(getattr, where, scene) for where in (held.where[:-1], held.where))
            delay = getattr(parent, "dead_time", 0.0)
            lag = 0.0 if held.lag is None else parent.lag
            numbers += [part.value(start - delay, part.first_piece(start - delay)), start - delay - 1.0, lag]
        return jnp.stack([start, *numbers])

    def _step(self) -> tuple[Program, int, tuple[int, int]]:
        shapes = tuple(InputShape(key, held.where, self.points[key]) for key, held in self.held.items())
        limits = np.asarray(self.rtol), np.asarray(np.inf), np.asarray(10_000, np.int32)
        _, packing = pack((self.scene, *limits))
        run, before, sizes = step_of_numbers(packing, method_of(self.scene, self.solver), shapes)

        def step(x: Array) -> tuple[Array, ...]:
            record = run(x)
            n, rows = record.count, record.rows
            counts = jnp.stack([record.code, n]).astype(jnp.int32)
            places = unravel(np.arange(sizes[1]), record.mode_like).pieces
            self.pieces = [int(places[input_piece(key)]) for key in self.held]
            now = rows.t[n], rows.y[n], rows.mode[n]
            columns = self._columns(record.system, *now, (record.y_like, record.mode_like))
            return counts, rows.t, _labels(record.modes), *now[1:], columns

        return Program(f"{self.name}_part", step, np.ones(before + 2 + sum(sizes))), before, sizes

    def places(self) -> dict[str, tuple[int, int]]:
        """First entry and number of entries of each column."""
        sizes = [column.size for column in self.columns.values()]
        starts = itertools.accumulate(sizes, initial=0)
        return {name: (start, size) for name, start, size in zip(self.columns, starts, sizes, strict=False)}

    @property
    def width(self) -> int:
        """Entries of all columns."""
        return sum(column.size for column in self.columns.values())

    # --- events

    def _changes(self) -> tuple[list[str], str]:
        """Names of events, and C that finds those of a change of mode."""
        name, system = self.name, assemble(self.scene)[0]
        mode: Mode = self.likes[1]
        kinds = [
            [int(band) for band in BandMode],
            [0, 1] if self.scene.brake.in_series else [0],
            [0, 1] if mode.turn is not None else [1],
            [0, 1] if mode.taut is not None else [1],
        ]
        states, driven = [*itertools.product(*kinds)], system.motor is not None
        endings = [
            [*Status].index(
                status_of(Label(state[0], state[1], state[2], 0, state[3]), moved, driven, lambda: away, lambda: steady)
            )
            for state in states
            for moved, driven, away, steady in itertools.product((False, True), repeat=4)
        ]
        resting = ", ".join(str(int(Label(state[0], state[1], state[2], 0, state[3]).rests)) for state in states)
        names: list[str] = []
        sequences, table = list[tuple[int, ...]]([()]), list[int]()
        for before, after, layer, first in itertools.product(states, states, (0, 1), (False, True)):
            was, now = (Label(s[0], s[1], s[2], n, s[3]) for s, n in ((before, 0), (after, layer)))
            events = events_of_change(was, now, first, driven) if was != now else []
            names += [event for event in events if event not in names]
            sequence = tuple(names.index(event) + 1 for event in events)
            if sequence not in sequences:
                sequences.append(sequence)
            table.append(sequences.index(sequence))
        most = max(map(len, sequences)) + 1
        rows = ", ".join("{" + ", ".join(map(str, [*sequence, 0][:most])) + "}" for sequence in sequences)
        place = "l[0]"
        for entry, kind in ((1, kinds[1]), (2, kinds[2]), (4, kinds[3])):
            place = f"({place}) * 2 + (l[{entry}] != 0)" if len(kind) > 1 else place
        numbers, endings = (
            "\n".join("  " + ", ".join(map(str, each[i : i + 40])) + "," for i in range(0, len(each), 40))
            for each in (table, endings)
        )
        return (
            names,
            f"""\
static const unsigned char {name}_sequences[][{most}] = {{{rows}}};
static const unsigned char {name}_changes[] = {{
{numbers}
}};
static const unsigned char {name}_endings[] = {{
{endings}
}};
static const unsigned char {name}_resting[] = {{{resting}}};
static int {name}_place(const int32_t *l) {{ return {place}; }}
static int {name}_rests(const int32_t *l) {{ return {name}_resting[{name}_place(l)]; }}
/* Appends the events of a change of mode; how many there are then. */
static int {name}_append({name}_event *events, int room, int count, double time, const int32_t *l, int first) {{
  const int32_t *m = l + 5;
  const unsigned char *sequence;
  if (memcmp(l, m, 5 * sizeof *l) == 0) return count;
  sequence = {name}_sequences[{name}_changes[
    (({name}_place(l) * {len(states)} + {name}_place(m)) * 2 + (l[3] != m[3])) * 2 + first]];
  for (; *sequence; sequence++, count++)
    if (count < room) {{ events[count].time = time; events[count].name = *sequence; }}
  return count;
}}
""",
        )

    # --- the file

    def _enum(self, what: str, entries: Iterable[tuple[str, int, str]]) -> str:
        lines = (
            f"  {self.upper}_{re.sub(r'[^A-Z0-9]+', '_', key.upper()).strip('_')} = {value}, /* {_words(about)} */"
            for key, value, about in entries
        )
        return f"enum {self.name}_{what} {{\n" + "\n".join(lines) + "\n};\n"

    def _strings(self, what: str, texts: Iterable[str]) -> str:
        entries = ", ".join(chr(34) + text + chr(34) for text in texts)
        return f"const char *const {self.name}_{what}[] = {{{entries}}};\n"

    def _declarations(self, codes: list[tuple[str, int, str]], states: int) -> str:
        """Enums of all that has a number."""
        count, width = self.numbers.size, self.width
        counted, places = self.like.unpack(np.arange(count, dtype=np.float64)), []
        for leaf in leaves(counted):
            size, first = int(np.size(leaf.value)), int(np.ravel(leaf.value)[0]) if np.size(leaf.value) else -1
            more = f", {size} numbers from here" if size > 1 else ""
            if size:
                places.append(
                    (f"NUMBER_{leaf.path}", first, f"{leaf.path} [{leaf.about.unit}]: {leaf.about.meaning}{more}")
                )
        about_columns = [
            (
                f"COLUMN_{key}",
                start,
                f"{key} [{SERIES_COLUMNS[key].unit}]: {SERIES_COLUMNS[key].meaning}"
                + (f", {size} of them" if size > 1 else ""),
            )
            for key, (start, size) in self.places().items()
        ]
        held = list(self.held.values())
        return "".join(
            [
                self._enum("number", places),
                self._enum(
                    "metric",
                    [(f"METRIC_{m}", i, f"[{unit_of(m)}]; infinite: never") for i, m in enumerate(self.outputs)],
                )
                if self.outputs
                else "",
                self._enum("event_name", [(f"EVENT_{event}", i + 1, event) for i, event in enumerate(self.events)]),
                self._enum("column", about_columns),
                self._enum(
                    "input", [(f"INPUT_{key}", i, f"[{h.unit}]") for i, (key, h) in enumerate(self.held.items())]
                )
                if held
                else "",
                self._enum("code", codes),
                self._enum("status", [(f"STATUS_{s}", i, STATUS_MESSAGES[s]) for i, s in enumerate(Status)])
                if self.runs
                else "",
                self._enum(
                    "size",
                    [
                        ("NUMBERS", count, "numbers of the scene"),
                        *([("METRICS", len(self.outputs), "metrics")] if self.runs else []),
                        ("COLUMNS", width, "entries of all columns"),
                        ("INPUTS", len(held), "inputs of the step"),
                        *([("STATES", states, "states")] if self.steps else []),
                        *([("ROWS", self.max_steps + 1, "rows that a run may fill")] if self.runs else []),
                    ],
                ),
            ]
        )

    def _stepping(self, begun: Program, step: Program, ny: int, nm: int) -> tuple[str, str, str]:
        """Types, prototypes and functions of the stepper."""
        name, upper, count, held = self.name, self.upper, self.numbers.size, list(self.held.values())
        width, points = self.width, [self.points[key] for key in self.held] or [1]
        least = [2 if h.lag is None else 4 for h in held] or [2]
        lower = ", ".join("1" if h.unit == "N" else "0" for h in held) or "0"
        prompt = ", ".join("0" if h.delay or h.lag is not None else "1" for h in held) or "0"
        start_out = _out(begun, "begun", 0) + ("" if begun.outs[0].size == 1 else "[0]")
        types = f"""\
typedef struct {{ double times[{max(points)}], values[{max(points)}]; int passed; double lag; }} {name}_held;

/* A brake between two steps: plain numbers, which may be copied, kept and set back. */
typedef struct {{
  double start, time, rtol;
  double numbers[{count}], y[{ny}], columns[{width}];
  int32_t mode[{nm}];
  int begun, holding; /* holding: the pulley is at rest */
  {name}_held held[{max(len(held), 1)}];
}} {name}_stepper;

"""
        prototypes = f"""\
/* A stepper at the start, under the scene's own inputs. */
int {name}_start({name}_memory *memory, const double *numbers, double rtol, {name}_stepper *stepper);
/* Advances by `dt` under inputs that are held from now on; on any other code than 0 the stepper stays as it was. */
int {name}_step({name}_memory *memory, {name}_stepper *stepper, double dt, const double *inputs,
    {name}_event *events, int most_events, int *events_found);
"""
        stepping = f"""\
static int {name}_integrate({name}_memory *memory, {name}_stepper *s, double end, {name}_event *events, int room,
    int *found) {{
  static const int points[] = {{{", ".join(map(str, points))}}};
  static const int places[] = {{{", ".join(map(str, self.pieces)) or "0"}}};
  double *x = memory->part_in, t0 = s->time;
  do {{
    int n = {count};
    memcpy(x, s->numbers, {count} * sizeof *x);
    x[n] = s->rtol; x[n + 1] = INFINITY; x[n + 2] = 10000; n += 3;
    for (int k = 0; k < {len(held)}; k++) {{
      memcpy(x + n, s->held[k].times, points[k] * sizeof *x); n += points[k];
      memcpy(x + n, s->held[k].values, points[k] * sizeof *x); n += points[k];
      if (s->y[0] == s->y[0]) s->mode[places[k]] = s->held[k].passed;
    }}
    x[n] = s->time; x[n + 1] = end; n += 2;
    memcpy(x + n, s->y, sizeof s->y); n += {ny};
    for (int i = 0; i < {nm}; i++) x[n + i] = s->mode[i];
    {_given(step, "part", 0, "x")}
    {step.name}_main(&memory->part);
    const int code = {_out(step, "part", 0)}[0], count = {_out(step, "part", 0)}[1];
    const double *t = {_out(step, "part", 1)};
    if (code != {upper}_CODE_COMPLETED && code != {upper}_CODE_STEP_LIMIT) return code;
    for (int i = 0, first = !s->begun && s->time == t0; i < count; i++) {{
      const int32_t *label = {_out(step, "part", 2)} + 5 * i;
      if (memcmp(label, label + 5, 5 * sizeof *label) == 0) continue;
      *found = {name}_append(events, events ? room : 0, *found, t[i + 1], label, first && t[i + 1] == t[0]);
      first = 0;
    }}
    s->time = t[count];
    s->holding = {name}_rests({_out(step, "part", 2)} + 5 * count);
    memcpy(s->y, {_out(step, "part", 3)}, sizeof s->y);
    memcpy(s->mode, {_out(step, "part", 4)}, sizeof s->mode);
    memcpy(s->columns, {_out(step, "part", 5)}, sizeof s->columns);
    for (int k = 0; k < {len(held)}; k++) s->held[k].passed = s->mode[places[k]];
  }} while (s->time < end);
  return {upper}_CODE_COMPLETED;
}}

int {name}_start({name}_memory *memory, const double *numbers, double rtol, {name}_stepper *stepper) {{
  static const int points[] = {{{", ".join(map(str, points))}}};
  {name}_stepper s = {{0}};
  int found = 0, code;
  if (memory == NULL) return {upper}_CODE_NO_MEMORY;
  if (!{name}_sound(numbers, {count}, rtol)) return {upper}_CODE_BAD_NUMBER;
  memcpy(s.numbers, numbers, sizeof s.numbers);
  {_given(begun, "begun", 0, "s.numbers")}
  {begun.name}_main(&memory->begun);
  s.start = s.time = {start_out};
  s.rtol = rtol;
  for (int k = 0; k < {len(held)}; k++) {{
    const double *about = {f"{_out(begun, 'begun', 0)} + 1 + 3 * k" if held else "&s.time"};
    for (int i = 0; i < points[k]; i++) {{ s.held[k].values[i] = about[0]; s.held[k].times[i] = about[1]; }}
    s.held[k].lag = about[2];
  }}
  s.y[0] = NAN;
  code = {name}_integrate(memory, &s, s.time, NULL, 0, &found);
  for (int k = 0; k < {len(held)}; k++) s.held[k].passed = points[k];
  if (code == {upper}_CODE_COMPLETED) *stepper = s;
  return code;
}}

int {name}_step({name}_memory *memory, {name}_stepper *stepper, double dt, const double *inputs,
    {name}_event *events, int most_events, int *events_found) {{
  static const int points[] = {{{", ".join(map(str, points))}}}, least[] = {{{", ".join(map(str, least))}}};
  static const int positive[] = {{{lower}}}, prompt[] = {{{prompt}}};
  {name}_stepper s = *stepper;
  int found = 0, code;
  if (memory == NULL) return {upper}_CODE_NO_MEMORY;
  if (!(dt >= 0 && dt < INFINITY)) return {upper}_CODE_BAD_NUMBER;
  for (int k = 0; k < {len(held)}; k++) {{
    {name}_held *h = &s.held[k];
    double *t = h->times, *v = h->values;
    const int n = points[k];
    if (!isfinite(inputs[k]) || (positive[k] && inputs[k] < 0)) return {upper}_CODE_BAD_NUMBER;
    if (inputs[k] == v[n - 1]) continue;
    if (s.time == s.start && prompt[k]) {{ /* it is what the run begins with */
      for (int i = 0; i < n; i++) v[i] = inputs[k];
      continue;
    }}
    if (h->passed < least[k]) return {upper}_CODE_TOO_MANY_COMMANDS;
    if (h->lag > 0) v[2] -= (v[1] - v[0]) * exp(-(t[2] - t[0]) / h->lag); /* what is left of a jump that is over */
    memmove(t, t + 2, (n - 2) * sizeof *t);
    memmove(v, v + 2, (n - 2) * sizeof *v);
    t[n - 2] = t[n - 1] = s.time;
    v[n - 2] = n > 2 ? v[n - 3] : stepper->held[k].values[n - 1];
    v[n - 1] = inputs[k];
    h->passed -= 2;
  }}
  code = {name}_integrate(memory, &s, s.time + dt, events, most_events, &found);
  if (code != {upper}_CODE_COMPLETED) return code;
  s.begun = s.begun || dt > 0;
  if (events_found) *events_found = found;
  *stepper = s;
  return code;
}}

"""
        return types, prototypes, stepping

    def _running(self, whole: Program, seen: Program, ny: int, nm: int) -> tuple[str, str, str]:
        """Type, prototype and function of the whole run, with its main()."""
        name, upper, count, width = self.name, self.upper, self.numbers.size, self.width
        metric_line = f"  memcpy(result->metrics, {_out(whole, 'whole', 0)}, sizeof result->metrics);\n"
        if len(self.outputs) < 2:
            metric_line = f"  result->metrics[0] = {_out(whole, 'whole', 0)};\n" if self.outputs else ""
        types = f"""\
typedef struct {{
  double metrics[{max(len(self.outputs), 1)}];
  int accepted, rejected, retaken, changes, segments; /* steps; events and segments of the integration */
  {name}_event *events; int most_events, events_found; /* space of the caller, or NULL; all that there were */
  double *columns; int most_rows, rows_found; /* rows of {upper}_COLUMNS numbers, or NULL: no rows are made */
  int status; /* an {name}_status, how a run ended that reached its end */
}} {name}_result;

"""
        prototypes = f"""\
extern const char *const {name}_metric_names[], *const {name}_status_names[];
/* The whole run with these numbers; an {name}_code. `result` names the space for events and columns. */
int {name}_run({name}_memory *memory, const double *numbers, double rtol, {name}_result *result);
"""
        running = f"""\
{self._strings("metric_names", self.outputs or [""])}{self._strings("status_names", Status)}
int {name}_run({name}_memory *memory, const double *numbers, double rtol, {name}_result *result) {{
  int events = 0, rows = 0;
  if (memory == NULL) return {upper}_CODE_NO_MEMORY;
  if (!{name}_sound(numbers, {count}, rtol)) return {upper}_CODE_BAD_NUMBER;
  memcpy(memory->whole_in, numbers, {count} * sizeof *numbers);
  memory->whole_in[{count}] = rtol;
  {_given(whole, "whole", 0, "memory->whole_in")}
  {whole.name}_main(&memory->whole);
  const int32_t *counts = {_out(whole, "whole", 1)};
  const int count = counts[1];
{metric_line}  result->accepted = counts[2]; result->rejected = counts[3]; result->retaken = counts[4];
  result->changes = counts[5]; result->segments = counts[6];
  const double *t = {_out(whole, "whole", 2)};
  for (int i = 0, first = 1; i < count; i++) {{
    const int32_t *label = {_out(whole, "whole", 6)} + 5 * i;
    if (memcmp(label, label + 5, 5 * sizeof *label) == 0) continue;
    events = {name}_append(result->events, result->events ? result->most_events : 0, events, t[i + 1], label,
        first && t[i + 1] == t[0]);
    first = 0;
  }}
  result->events_found = events;
  for (int i = 0; i <= count && result->columns; i++) {{
    if (i < count && {_out(whole, "whole", 5)}[i] == {SKIPPED}) continue;
    if (rows < result->most_rows) {{
      {_given(seen, "seen", 0, "memory->whole_in")}
      {_given(seen, "seen", 1, "t + i")}
      {_given(seen, "seen", 2, f"{_out(whole, 'whole', 3)} + {ny} * i")}
      {_given(seen, "seen", 3, f"{_out(whole, 'whole', 4)} + {nm} * i")}
      {seen.name}_main(&memory->seen);
      memcpy(result->columns + {width} * (size_t)rows, {_out(seen, "seen", 0)}, {width} * sizeof(double));
    }}
    rows++;
  }}
  result->rows_found = rows;
  const int32_t *flags = {_out(whole, "whole", 7)};
  result->status = {name}_endings[{name}_place({_out(whole, "whole", 6)} + 5 * count) * 16
    + flags[0] * 8 + flags[1] * 4 + flags[2] * 2 + flags[3]];
  return counts[0];
}}

#ifdef {upper}_MAIN
#include <stdio.h>
int main(void) {{
  static {name}_event events[1000];
  {name}_result result = {{{{0}}}};
  {name}_memory *memory = {name}_new();
  int code;
  result.events = events;
  result.most_events = 1000;
  code = {name}_run(memory, {name}_numbers, {self.rtol!r}, &result);
  for (int i = 0; i < {len(self.outputs)}; i++) printf("%s = %.17g\\n", {name}_metric_names[i], result.metrics[i]);
  for (int i = 0; i < result.events_found && i < 1000; i++)
    printf("%.17g s  %s\\n", events[i].time, {name}_event_names[events[i].name]);
  if (code) fprintf(stderr, "%s\\n", code > 0 ? {name}_code_names[code] : "no memory");
  {name}_free(memory);
  return code != 0;
}}
#endif
"""
        return types, prototypes, running

    def text(self) -> str:
        name, upper, count = self.name, self.upper, self.numbers.size
        programs: dict[str, Program] = {}
        # one after another: types, prototypes, functions
        parts: list[tuple[str, str, str]] = []
        room, states = "", 0
        if self.steps:
            begun = Program(f"{name}_begun", self._begun, self.numbers)
            step, before, (states, nm) = self._step()
            programs |= {"begun": begun, "part": step}
            parts.append(self._stepping(begun, step, states, nm))
            room = f" double part_in[{before + 2 + states + nm}];"
        if self.runs:
            now = [np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(like)]) for like in self.likes]
            sizes = now[0].size, now[1].size
            whole = Program(f"{name}_whole", self._whole, np.append(self.numbers, self.rtol))
            seen = Program(f"{name}_seen", self._seen, self.numbers, np.asarray(0.0), now[0], now[1].astype(np.int32))
            programs |= {"whole": whole, "seen": seen}
            parts.insert(0, self._running(whole, seen, *sizes))
            room += f" double whole_in[{count + 1}];"
        self.bytes = sum(program.bytes for program in programs.values())
        self.events, changes = self._changes()
        codes = [("CODE_COMPLETED", 0, "the run reached its end")]
        codes += [(f"CODE_{key}", int(code), what) for code, (key, what, _) in FAILURES.items()]
        codes += [
            ("CODE_BAD_NUMBER", -1, "a number, a time or an input is not finite, or out of range"),
            ("CODE_NO_MEMORY", -2, "there is no memory"),
            ("CODE_TOO_MANY_COMMANDS", -3, "more commands than there is space for wait in a dead time"),
        ]
        declarations = self._declarations(codes, states)
        values = ", ".join(literal(v, "double") for v in self.numbers)
        frames = "".join(f"  struct {program.name}_frame {key};\n" for key, program in programs.items())
        types, prototypes, functions = ("".join(texts) for texts in zip(*parts, strict=True))
        main = f";\n   with {upper}_MAIN it has a main() that runs the scene and prints metrics and events" * self.runs
        return f"""\
/* {name}: {_words(self.scene.brake.kind)}, as C99 by simbrake {_version()}, from the scene given to it.

   All in SI units. Compile with -std=c99 -ffp-contract=off and link with the mathematical library (-lm).
   With {upper}_DECLARATIONS defined before it is included, this file gives declarations alone{main}. */
#ifndef {upper}_H
#define {upper}_H
#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {{
#endif
{declarations}
typedef struct {{ double time; int name; }} {name}_event; /* name: an {name}_event_name */

{types}typedef struct {name}_memory {name}_memory; /* working memory of one thread */
{name}_memory *{name}_new(void); /* NULL where there is none */
void {name}_free({name}_memory *memory);

extern const double {name}_numbers[{upper}_NUMBERS]; /* those of the scene */
extern const char *const {name}_event_names[], *const {name}_code_names[];

{prototypes}#ifdef __cplusplus
}}
#endif
#endif

#ifndef {upper}_DECLARATIONS
{HELPERS}
{"".join(program.text for program in programs.values())}
struct {name}_memory {{
{frames} {room}
}};

const double {name}_numbers[{upper}_NUMBERS] = {{{values}}};
{self._strings("event_names", ["", *self.events])}{self._strings("code_names", _by_number(codes))}
{name}_memory *{name}_new(void) {{ return ({name}_memory *)calloc(1, sizeof({name}_memory)); }}
void {name}_free({name}_memory *memory) {{ free(memory); }}

{changes}
static int {name}_sound(const double *x, int count, double rtol) {{
  if (!(rtol > 1e-15 && rtol < 0.1)) return 0;
  for (int i = 0; i < count; i++) if (x[i] != x[i]) return 0;
  return 1;
}}

{functions}#endif
"""


def _by_number(codes: Iterable[tuple[str, int, str]]) -> list[str]:
    """Names of the codes from 0 on, at their numbers."""
    names = {number: key.removeprefix("CODE_").lower() for key, number, _ in codes}
    return [names.get(number, "") for number in range(max(names) + 1)]


def _version() -> str:
    return importlib.import_module("simbrake").__version__
