"""A scene as C: compiled by the C compiler of the machine, beside prepared runs and the
`Stepper`."""

import ctypes
import re

import equinox as eqx
import jax
import numpy as np
import pytest
import shipped
from c_compiler import NEEDED, library_of
from helpers import all_near, input_error

import simbrake as sb

pytestmark = NEEDED
METRICS = ["slip_onset_time", "full_slip_time", "stopping_time"]


def c_names(at, first):
    """Names of an enum by their numbers."""
    return {
        n: name.removeprefix(first).lower()
        for name, n in at.items()
        if name.startswith(first)
    }


class Compiled:
    """The functions of a C file by way of ctypes, its names from the text."""

    def __init__(self, file):
        text = file.read_text()
        self.name = file.stem
        entries = re.findall(
            rf"^  {self.name.upper()}_(\w+) = (-?\d+), /\*", text, re.MULTILINE
        )
        self.at = {entry: int(n) for entry, n in entries}
        c = ctypes
        at = self.at
        self.library = library = library_of(file)

        class Event(c.Structure):
            _fields_ = (("time", c.c_double), ("name", c.c_int))

        class Run(c.Structure):
            _fields_ = (
                ("metrics", c.c_double * max(at["METRICS"], 1)),
                ("counts", c.c_int * 5),
                ("events", c.POINTER(Event)),
                ("most_events", c.c_int),
                ("events_found", c.c_int),
                ("columns", c.c_void_p),
                ("most_rows", c.c_int),
                ("rows_found", c.c_int),
                ("status", c.c_int),
                ("reason", c.c_int),
                ("colour", c.c_int),
                ("numbers", c.c_double * 3),
            )

        self.Event = Event
        self.Run = Run
        for function in (
            "new",
            "free",
            "run",
            *(("start", "step") if "STATES" in self.at else ()),
        ):
            setattr(self, f"_{function}", getattr(library, f"{self.name}_{function}"))
        self._new.restype = c.c_void_p
        self.memory = c.c_void_p(self._new())
        self.numbers = np.array(
            (c.c_double * at["NUMBERS"]).in_dll(library, f"{self.name}_numbers")
        )
        self.events = c_names(at, "EVENT_")

    def run(self, rtol=1e-10, **numbers):
        """Code, metrics, counts, events and columns of a run."""
        x = self.numbers.copy()
        for name, value in numbers.items():
            x[self.at[f"NUMBER_{name.upper()}"]] = value
        events = (self.Event * 1000)()
        run = self.Run()
        columns = np.zeros((self.at["ROWS"], self.at["COLUMNS"]))
        run.events = events
        run.most_events = 1000
        run.columns = columns.ctypes.data
        run.most_rows = len(columns)
        code = self._run(
            self.memory,
            x.ctypes.data_as(ctypes.c_void_p),
            ctypes.c_double(rtol),
            ctypes.byref(run),
        )
        log = [
            (self.events[event.name], event.time)
            for event in events[: run.events_found]
        ]
        self.status = c_names(self.at, "STATUS_")[run.status]
        return (
            code,
            np.array(run.metrics),
            [*run.counts],
            log,
            columns[: run.rows_found],
        )

    def start(self, rtol=1e-10):
        self.stepper = ctypes.create_string_buffer(1 << 20)
        return self._start(
            self.memory,
            self.numbers.ctypes.data_as(ctypes.c_void_p),
            ctypes.c_double(rtol),
            self.stepper,
        )

    def step(self, dt, *inputs):
        """Code and events of a step."""
        events = (self.Event * 100)()
        found = ctypes.c_int()
        x = np.asarray(inputs, float)
        pointer = x.ctypes.data_as(ctypes.c_void_p)
        code = self._step(
            self.memory,
            self.stepper,
            ctypes.c_double(dt),
            pointer,
            events,
            100,
            ctypes.byref(found),
        )
        return code, [
            (self.events[event.name], event.time) for event in events[: found.value]
        ]

    @property
    def columns(self):
        start = 3 + self.at["NUMBERS"] + self.at["STATES"]
        return np.frombuffer(self.stepper, float)[start : start + self.at["COLUMNS"]]


@pytest.fixture(scope="module")
def stop():
    return sb.read_scene(sb.files.shipped("u2_5_5_stop"))


@pytest.fixture(scope="module")
def compiled(stop, tmp_path_factory):
    return Compiled(
        sb.export_c(stop, tmp_path_factory.mktemp("c") / "stop.c", inputs=["lever"])
    )


def changes(result, compiled):
    """Events of the log that C knows: changes of mode."""
    known = {*compiled.events.values()}
    return [(event.name, event.time) for event in result.events if event.name in known]


def same_events(events, expected, rtol):
    assert [name for name, _ in events] == [name for name, _ in expected]
    all_near([time for _, time in events], [time for _, time in expected], rtol)


def test_run_is_the_prepared_one(stop, compiled):
    code, metrics, counts, events, columns = compiled.run()
    prepared = sb.prepare(stop, METRICS)()
    result = sb.simulate(stop)
    assert (code, counts) == (0, [*prepared[2:]])
    all_near(metrics, [*prepared.metrics.values()], 1e-12)
    same_events(events, changes(result, compiled), 1e-12)
    assert compiled.status == result.status
    record = result.record.compact()
    rows = np.append(
        np.diff(np.asarray(record.rows.t)[: int(record.count) + 1]) > 0, True
    )  # the last ones at each time
    series = result.series(columns[rows, compiled.at["COLUMN_T"]])
    for name in ("omega", "phi", "brake_torque", "tight_tension", "slip_speed"):
        all_near(
            columns[rows, compiled.at[f"COLUMN_{name.upper()}"]],
            getattr(series, name),
            1e-11,
            1e-9,
        )


def test_anchor_that_comes_to_the_ground(stop, tmp_path):
    anchor = sb.loads.WindlassLoad("5 t", 100.0, "0.4 m", "6 m", "10 m", "200 m")
    duty = sb.Duty(4e3, anchor)
    scene = sb.Scene(stop.brake, duty, sb.Initial(12.0), 9.0)
    outputs = ["stopping_time", "energy.pick_up_heat", "max_rope_tension"]
    compiled = Compiled(sb.export_c(scene, tmp_path / "anchor.c", outputs=outputs))
    code, metrics, _, events, _ = compiled.run()
    result = sb.simulate(scene)
    assert (code, compiled.status) == (0, result.status)
    expected = changes(result, compiled)
    assert "anchor_grounded" in [name for name, _ in events]
    same_events(events, expected, 1e-11)
    all_near(metrics, [float(result[x]) for x in outputs], 1e-10)


def test_staged_run_with_heat(tmp_path):
    """To 1e-12 where the steps agree, else to a tenth of the estimated error: C may
    round otherwise."""
    scene = shipped.load("staged_vs_standard").scene()
    compiled = Compiled(sb.export_c(scene, tmp_path / "staged.c"))
    result = sb.simulate(scene)
    code, _, counts, events, _ = compiled.run()
    expected = changes(result, compiled)
    assert (code, compiled.status) == (0, result.status)
    assert [name for name, _ in events] == [name for name, _ in expected]
    assert {"internal_slip", "external_lock", "stop"} <= {name for name, _ in events}
    agrees = counts == [int(count) for count in result.record.stats]
    close = (
        {"rtol": 1e-12}
        if agrees
        else {"rtol": 0, "atol": 0.1 * result.accuracy().event_time}
    )
    all_near([time for _, time in events], [time for _, time in expected], **close)


def test_more_changes_of_mode_than_fit_in_a_byte(tmp_path):
    """Band, internal pair, shaft and rope each have modes: 260 sequences of events,
    numbered in a table."""
    scene = shipped.load("everything_coupled").scene()
    compiled = Compiled(sb.export_c(scene, tmp_path / "coupled.c"))
    result = sb.simulate(scene)
    code, _, _, events, _ = compiled.run()
    assert (code, compiled.status) == (0, result.status)
    same_events(events, changes(result, compiled), 1e-9)


def test_numbers_are_those_of_the_call(stop, compiled):
    values = {"initial.omega": 18.0, "brake.pulley.inertia": 900.0}
    given = {path.replace(".", "_"): value for path, value in values.items()}
    _, metrics, _, events, _ = compiled.run(**given)
    result = sb.simulate(sb.with_values(stop, values))
    wanted = [float(result[name]) for name in METRICS]
    all_near(metrics, wanted, 1e-12)
    same_events(events, changes(result, compiled), 1e-12)
    for path, value in {"initial.omega": 0.0, "end_time": 0.5}.items():
        assert compiled.run(**{path.replace(".", "_"): value})[0] == 0
        assert (
            compiled.status == sb.simulate(sb.with_values(stop, {path: value})).status
        )
    bad = compiled.at["CODE_BAD_NUMBER"]
    assert compiled.run(initial_omega=np.nan)[0] == bad
    assert compiled.run(rtol=-1.0)[0] == bad
    assert compiled.run(brake_pulley_inertia=0.0)[0] == bad


def test_what_has_no_form_in_c_is_named(stop, tmp_path):
    shape = jax.ShapeDtypeStruct((), np.float64)
    outside = lambda t, p: jax.pure_callback(np.asarray, shape, p)
    other = lambda t, p: p + jax.lax.lgamma(2.0 + 0.0 * t)
    for course, words in ((outside, "which has no C form yet"), (other, "lgamma")):
        lever = sb.profiles.FunctionProfile(course, 20e3, typical=20e3)
        scene = eqx.tree_at(lambda x: x.duty.slack_tension, stop, lever)
        with input_error(match=words):
            sb.export_c(scene, tmp_path / "x.c")
    assert [*tmp_path.iterdir()] == []


def test_steps_are_those_of_the_stepper(stop, compiled):
    stepper = sb.Stepper(stop, ["lever"])
    assert compiled.start() == 0
    # (a command that lasts no time gives way to the next one)
    for dt, lever in (
        (0.13, 3e3),
        (0.13, 9e3),
        (0.13, 9e3),
        (0.0, 5e3),
        (0.13, 0.0),
        (0.13, 24e3),
        (0.13, 60e3),
    ):
        expected = stepper.advance(dt, lever=lever)
        code, events = compiled.step(dt, lever)
        assert code == 0
        same_events(
            events, [(event.name, event.time) for event in expected.events], 1e-10
        )
        for name in ("t", "omega", "phi", "brake_torque", "slack_tension"):
            found = compiled.columns[compiled.at[f"COLUMN_{name.upper()}"]]
            all_near(found, stepper[name], 1e-10, 1e-10)
    before = compiled.stepper.raw
    assert (
        compiled.step(0.1, -1.0)[0]
        == compiled.step(-0.1, 1.0)[0]
        == compiled.at["CODE_BAD_NUMBER"]
    )
    assert compiled.stepper.raw == before
