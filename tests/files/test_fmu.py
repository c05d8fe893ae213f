"""The FMU of a scene, run by FMPy, beside the `Stepper` under the same held inputs."""

import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET

import fmpy
import fmpy.fmi2
import fmpy.fmi3
import fmpy.validation
import numpy as np
import pytest
from commands import call
from heat_scenes import layered_stop

import simbrake as sb

COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
OUTPUTS = ("omega", "phi", "brake_torque", "slack_tension", "tight_tension")
COMMANDS = [(3e3, 2e3), (9e3, 5e3), (1e3, 8e3), (20e3, 5e3), (20e3, 5e3), (0.0, 9e3)]


@pytest.fixture(scope="module")
def scene():
    brake = sb.Brake(
        sb.Pulley("590 mm", 1200.0),
        sb.Band("623 mm"),
        sb.uniform_linings(12, "270 deg", 0.35),
    )
    lever = sb.loads.Actuator(24e3, lag="60 ms", dead_time="130 ms")
    return sb.Scene(
        brake, sb.Duty(lever, sb.TorqueLoad("5 kN*m")), sb.Initial(24.0), "5 s"
    )


@pytest.fixture(scope="module")
def file(scene, tmp_path_factory):
    if COMPILER is None:
        pytest.skip("no C compiler")
    return sb.export.export_fmu(scene, tmp_path_factory.mktemp("c") / "brake.fmu")


class Run:
    """An instance of an FMU, by names."""

    def __init__(self, file, start=0.0, begin=True, **values):
        self.said = []
        described = fmpy.read_model_description(file)
        self.vr = {one.name: one.valueReference for one in described.modelVariables}
        self.fmu = fmpy.fmi2.FMU2Slave(
            guid=described.guid,
            unzipDirectory=str(fmpy.extract(file)),
            modelIdentifier=described.coSimulation.modelIdentifier,
            instanceName="brake",
        )
        callbacks = fmpy.fmi2.fmi2CallbackFunctions()
        log = lambda env, name, status, category, message: self.said.append(
            message.decode()
        )
        callbacks.logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(log)
        self.callbacks = callbacks
        self.fmu.instantiate(callbacks=callbacks, loggingOn=True)
        if begin:
            self.set(**values)
            self.fmu.setupExperiment(startTime=start)
            self.fmu.enterInitializationMode()
            self.fmu.exitInitializationMode()

    def set(self, **values):
        self.fmu.setReal([self.vr[name] for name in values], list(values.values()))

    def get(self, *names):
        return self.fmu.getReal([self.vr[name] for name in names])

    def steps(self, commands, t, dt=0.13):
        found = []
        for lever, load in commands:
            self.set(lever=lever, load=load)
            self.fmu.doStep(t, dt)
            t += dt
            found.append(self.get(*OUTPUTS))
        return found


def test_description_is_valid_and_says_units(file):
    assert fmpy.validation.validate_fmu(str(file)) == []
    described = fmpy.read_model_description(file)
    assert described.coSimulation.canGetAndSetFMUstate
    assert described.coSimulation.canSerializeFMUstate
    about = {
        one.name: (one.causality, one.type, one.unit)
        for one in described.modelVariables
    }
    assert about["lever"] == ("input", "Real", "N")
    assert about["load"] == ("input", "Real", "N.m")
    assert about["omega"] == ("output", "Real", "rad/s")
    assert about["band_mode"][:2] == ("output", "Integer")
    assert about["brake.pulley.inertia"] == ("parameter", "Real", "kg.m2")
    assert about["holding"] == ("output", "Boolean", None)
    assert about["rtol"][:2] == ("parameter", "Real")
    assert not {"t", "holding_reserve", "tension", "brake.linings.angle"} & set(about)
    starts = {
        one.name: float(one.start)
        for one in described.modelVariables
        if one.start not in (None, "false")
    }
    assert {
        name: starts[name]
        for name in ("load", "initial.omega", "duty.slack_tension.lag", "rtol")
    } == {
        "load": 5e3,
        "initial.omega": 24.0,
        "duty.slack_tension.lag": 0.06,
        "rtol": 1e-10,
    }
    kinds = {one.name: one.variability for one in described.modelVariables}
    assert [kinds[name] for name in ("band_mode", "holding", "initial.omega")] == [
        "discrete",
        "discrete",
        "fixed",
    ]
    assert described.generationTool == f"simbrake {sb.__version__}"
    bases = {unit.name: unit.baseUnit for unit in described.unitDefinitions}
    assert (bases["N.m"].kg, bases["N.m"].m, bases["N.m"].s) == (1, 2, -2)
    outputs = [one.variable.name for one in described.outputs]
    assert [one.variable.name for one in described.initialUnknowns] == outputs
    assert outputs == [
        one.name for one in described.modelVariables if one.causality == "output"
    ]


def of_stepper(scene):
    """A stepper after all commands, what it gave after each, and its events."""
    stepper = sb.Stepper(scene, ["lever", "load"])
    wanted = []
    events = []
    for lever, load in COMMANDS:
        events += stepper.advance(0.13, lever=lever, load=load).events
        wanted.append([stepper[name] for name in OUTPUTS])
    return stepper, wanted, events


def test_fmu_is_the_stepper(scene, file):
    stepper, wanted, _ = of_stepper(scene)
    run = Run(file, start=7.0)  # the clock of the scene begins with the simulation
    np.testing.assert_allclose(run.steps(COMMANDS, 7.0), wanted, rtol=1e-12, atol=0)
    assert run.fmu.getBoolean([run.vr["holding"]]) == [stepper.holding]
    assert run.fmu.getInteger([run.vr["band_mode"]]) == [stepper["band_mode"]]
    assert len({tuple(row) for row in wanted}) == len(COMMANDS)


def test_states_are_kept_and_set_back(file):
    run = Run(file)
    run.steps(COMMANDS[:3], 0.0)
    kept = run.fmu.getFMUstate()
    data = run.fmu.serializeFMUstate(kept)
    first = run.steps(COMMANDS[3:], 0.39)
    run.fmu.setFMUstate(kept)
    np.testing.assert_array_equal(run.steps(COMMANDS[3:], 0.39), first)
    other = Run(file)
    other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(data))
    np.testing.assert_array_equal(other.steps(COMMANDS[3:], 0.39), first)
    slower = Run(file, **{"initial.omega": 12.0, "brake.pulley.inertia": 900.0})
    slower.steps(COMMANDS[:1], 0.0)
    slower.fmu.setFMUstate(slower.fmu.deSerializeFMUstate(data))
    assert slower.get("initial.omega", "brake.pulley.inertia") == [24.0, 1200.0]
    np.testing.assert_array_equal(slower.steps(COMMANDS[3:], 0.39), first)


def test_parameters_are_fixed_in_a_state_that_runs(file):
    """Also in an instance that did not begin by itself."""
    run = Run(file)
    run.steps(COMMANDS[:2], 0.0)
    data = run.fmu.serializeFMUstate(run.fmu.getFMUstate())
    other = Run(file, begin=False)
    other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(data))
    with pytest.raises(fmpy.fmi1.FMICallException):
        other.set(**{"initial.omega": 12.0})
    np.testing.assert_array_equal(
        other.steps(COMMANDS[2:], 0.26), run.steps(COMMANDS[2:], 0.26)
    )


def test_state_has_its_outputs_and_its_clock(file):
    """Set back in an instance whose simulation began at another time: its clock goes
    on, outputs are those then."""
    run = Run(file, start=7.0)
    kept = run.steps(COMMANDS[:3], 7.0)[-1]
    data = run.fmu.serializeFMUstate(run.fmu.getFMUstate())
    later = run.steps(COMMANDS[3:], 7.39)
    other = Run(file, start=1.0)
    other.steps(COMMANDS[:1], 1.0)
    other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(data))
    assert other.get(*OUTPUTS) == kept
    np.testing.assert_array_equal(other.steps(COMMANDS[3:], 7.39), later)


@pytest.mark.skipif(COMPILER is None, reason="no C compiler")
def test_clock_of_a_scene_that_starts_later(scene, tmp_path):
    """The time of the simulation is not that of the scene, which begins at 2 s."""
    late = sb.with_values(scene, {"initial.time": 2.0, "end_time": 9.0})
    stepper = sb.Stepper(late, ["lever", "load"])
    wanted = []
    for lever, load in COMMANDS[:2]:
        stepper.advance(0.13, lever=lever, load=load)
        wanted.append([stepper[name] for name in OUTPUTS])
    run = Run(sb.export.export_fmu(late, tmp_path / "late.fmu"), start=7.0)
    np.testing.assert_allclose(run.steps(COMMANDS[:2], 7.0), wanted, rtol=1e-12)


def test_parameters_and_failed_steps(file):
    run = Run(file, **{"initial.omega": 12.0})
    assert run.get("omega") == [12.0]
    with pytest.raises(fmpy.fmi1.FMICallException, match="error"):
        run.steps([(-3.0, 0.0)], 0.0)
    assert any("lever: -3" in text and "is out of range" in text for text in run.said)
    assert run.get("omega") == [12.0]
    with pytest.raises(fmpy.fmi1.FMICallException, match="error"):
        run.steps([(3e3, 0.0)], 1e-6)
    assert any(
        "the step begins at" in text and "the brake is at 0" in text
        for text in run.said
    )
    run.steps([(3e3, 0.0)], 1e-10)  # a clock that has summed up its steps
    assert run.get("omega")[0] < 12.0


@pytest.fixture(scope="module", params=[2, 3])
def file_of_either_version(scene, request, tmp_path_factory):
    if COMPILER is None:
        pytest.skip("no C compiler")
    return sb.export.export_fmu(
        scene, tmp_path_factory.mktemp("either") / "brake.fmu", fmi=request.param
    )


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"lever": -1e-9}, "lever: -1e-09 N is out of range, 0 to 1e+40 N"),
        ({"lever": -5.0}, "lever: -5 N is out of range, 0 to 1e+40 N"),
        ({"lever": 1e41}, "lever: 1e+41 N is out of range"),
        ({"lever": np.inf}, "lever: inf N is out of range"),
        ({"lever": np.nan}, "lever: "),
        ({"load": -np.inf}, "load: -inf N.m is out of range"),
        ({"brake.pulley.inertia": np.nan}, "brake.pulley.inertia: "),
    ],
)
def test_wrong_values_end_a_simulation_at_once(file_of_either_version, wrong, words):
    """An importer tries a step that is discarded again, also with a value that no step
    allows."""
    said = []
    with pytest.raises(fmpy.fmi1.FMICallException, match="error"):
        fmpy.simulate_fmu(
            str(file_of_either_version),
            stop_time=1.0,
            start_values=wrong,
            timeout=20,
            logger=lambda *x: said.append(x),
        )
    (text,) = (entry[-1].decode() for entry in said if b"out of range" in entry[-1])
    assert text.startswith(words)


def test_events_within_steps(scene, file):
    events = of_stepper(scene)[2]
    run = Run(file)
    run.steps(COMMANDS, 0.0)
    assert [text.split(" s  ") for text in run.said] == [
        [f"{event.time:.17g}", event.name] for event in events
    ]
    assert run.fmu.getInteger([run.vr["event_count"]]) == [len(events)]
    names = next(
        one
        for one in fmpy.read_model_description(file).modelVariables
        if one.name == "last_event"
    )
    number = run.fmu.getInteger([run.vr["last_event"]])[0]
    assert f"{number} {events[-1].name}" in names.description
    assert run.get("last_event_time") == [events[-1].time]


def test_numbers_of_lists_and_bad_ones(scene, file):
    """Entries of lists are parameters too; one out of range ends the initialization by
    its name."""
    shorter = {"brake.linings.angle[3]": 0.3, "brake.linings.angle[7]": 0.35}
    run = Run(file, **shorter)
    np.testing.assert_allclose(
        run.steps(COMMANDS, 0.0),
        of_stepper(sb.with_values(scene, shorter))[1],
        rtol=1e-12,
    )
    run.fmu.reset()
    run.fmu.setupExperiment(startTime=0.0)
    run.fmu.enterInitializationMode()
    run.set(**{"brake.pulley.inertia": -1.0})
    with pytest.raises(fmpy.fmi1.FMICallException, match="error"):
        run.fmu.exitInitializationMode()
    assert "brake.pulley.inertia: -1 kg.m2 is out of range" in run.said[-1]


def test_fmi_3(scene, tmp_path):
    if COMPILER is None:
        pytest.skip("no C compiler")
    file = sb.export.export_fmu(scene, tmp_path / "brake.fmu", fmi=3)
    assert fmpy.validation.validate_fmu(str(file)) == []
    described = fmpy.read_model_description(file)
    vr = {one.name: one.valueReference for one in described.modelVariables}
    fmu = fmpy.fmi3.FMU3Slave(
        guid=described.guid,
        unzipDirectory=str(fmpy.extract(file)),
        modelIdentifier=described.coSimulation.modelIdentifier,
        instanceName="brake",
    )
    fmu.instantiate()
    fmu.enterInitializationMode(startTime=7.0)
    fmu.exitInitializationMode()

    def steps(commands, t):
        found = []
        for lever, load in commands:
            fmu.setFloat64([vr["lever"], vr["load"]], [lever, load])
            fmu.doStep(t, 0.13)
            t += 0.13
            found.append(fmu.getFloat64([vr[name] for name in OUTPUTS]))
        return found

    stepper, wanted, events = of_stepper(scene)
    np.testing.assert_allclose(steps(COMMANDS[:3], 7.0), wanted[:3], rtol=1e-12)
    kept = fmu.serializeFMUState(fmu.getFMUState())
    np.testing.assert_allclose(steps(COMMANDS[3:], 7.39), wanted[3:], rtol=1e-12)
    assert fmu.getInt32([vr["event_count"], vr["band_mode"]]) == [
        len(events),
        stepper["band_mode"],
    ]
    assert fmu.getBoolean([vr["holding"]]) == [stepper.holding]
    fmu.setFMUState(fmu.deserializeFMUState(kept))
    np.testing.assert_allclose(steps(COMMANDS[3:], 7.39), wanted[3:], rtol=1e-12)


def test_without_a_compiler(scene, tmp_path, monkeypatch):
    """Sources alone, said aloud, which any C compiler makes a binary of; one that fails
    is an error."""
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.warns(UserWarning, match="no C compiler was found"):
        file = sb.export.export_fmu(scene, tmp_path / "brake.fmu", "lever")
    monkeypatch.undo()
    folder = fmpy.extract(file, tmp_path / "inside")
    assert (
        ET.parse(f"{folder}/modelDescription.xml")
        .find(".//SourceFiles/File")
        .get("name")
        == "fmu.c"
    )
    assert not (tmp_path / "inside" / "binaries").exists()
    if COMPILER:
        flags = [
            "-std=c99",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-Wno-unused",
            "-Wno-tautological-compare",
            "-fsyntax-only",
        ]
        subprocess.run([COMPILER, *flags, f"{folder}/sources/fmu.c"], check=True)
    with pytest.raises(sb.InputError, match="compiler: nocc is not there"):
        sb.export.export_fmu(scene, tmp_path / "brake.fmu", compiler="nocc")
    with pytest.raises(sb.InputError, match="compiler: false failed"):
        sb.export.export_fmu(scene, tmp_path / "brake.fmu", compiler="false")


def test_what_cannot_be_an_fmu(scene, tmp_path):
    with pytest.raises(sb.InputError, match=r"give a name with \.fmu"):
        sb.export.export_fmu(scene, tmp_path / "brake.zip")
    with pytest.raises(sb.InputError, match="fmi: 4 is no version of FMI here"):
        sb.export.export_fmu(scene, tmp_path / "brake.fmu", fmi=4)
    with pytest.raises(sb.InputError, match="waiting: 0 is out of range"):
        sb.export.export_fmu(scene, tmp_path / "brake.fmu", waiting=0)


def test_hottest_node_is_an_output(tmp_path):
    """Of several temperatures the maximum; of single linings nothing."""
    read = fmpy.read_model_description(
        sb.export.export_fmu(layered_stop(), tmp_path / "hot.fmu")
    )
    about = {one.name: one for one in read.modelVariables}
    assert (about["rim_temperature"].causality, about["rim_temperature"].unit) == (
        "output",
        "K",
    )
    assert "normal_load" not in about
    bases = {unit.name: unit.baseUnit for unit in read.unitDefinitions}
    assert [getattr(bases["W/(m2.K)"], x) for x in ("kg", "m", "s", "K")] == [
        1,
        0,
        -3,
        -1,
    ]
    assert [getattr(bases["J/(kg.K)"], x) for x in ("kg", "m", "s", "K")] == [
        0,
        2,
        -2,
        -1,
    ]


def test_command_writes_an_fmu(scene, tmp_path, capsys):
    file = tmp_path / "x.fmu"
    source = str(tmp_path / "brake.toml")
    sb.write_scene(scene, source)
    code, out, _ = call(
        capsys, "export", source, "--fmu", str(file), "--set", "initial.omega=9"
    )
    assert (code, out) == (0, f"written  {file}\n")
    (speed,) = (
        one
        for one in fmpy.read_model_description(file).modelVariables
        if one.name == "initial.omega"
    )
    assert float(speed.start) == 9.0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["brake.toml", "x.fmu"]
    code, out, told = call(capsys, "fmu", source, "--out", str(tmp_path / "y.fmu"))
    assert (code, out, told.count("\n")) == (2, "", 1)
    assert "fmu went: simbrake export SCENE --fmu FILE.fmu" in told
    with pytest.raises(AttributeError, match=r"files\.write_fmu went: .*export_fmu"):
        _ = sb.files.write_fmu
