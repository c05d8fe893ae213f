"""The FMU of a scene, run by FMPy, beside the `Stepper` under the same held inputs."""

import subprocess
import sys

import fmpy
import fmpy.fmi2
import fmpy.fmi3
import fmpy.validation
import numpy as np
import pytest
from c_compiler import COMPILER
from commands import call
from helpers import all_equal, all_near, paths_of
from scenes import drawworks_brake

import simbrake as sb

OUTPUTS = ("omega", "phi", "brake_torque", "slack_tension", "tight_tension")
COMMANDS = [(3e3, 2e3), (9e3, 5e3), (1e3, 8e3), (20e3, 5e3), (20e3, 5e3), (0.0, 9e3)]


@pytest.fixture(scope="module")
def scene():
    brake = drawworks_brake(12)
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
    about = {x.name: (x.causality, x.type, x.unit) for x in described.modelVariables}
    assert about["lever"] == ("input", "Real", "N")
    assert about["load"] == ("input", "Real", "N.m")
    assert about["omega"] == ("output", "Real", "rad/s")
    assert about["band_mode"][:2] == ("output", "Integer")
    assert about["brake.pulley.inertia"] == ("parameter", "Real", "kg.m2")
    assert not {"t", "tension", "brake.linings.angle"} & set(about)
    starts = {x.name: x.start for x in described.modelVariables}
    assert float(starts["load"]) == 5000.0
    assert float(starts["duty.slack_tension.lag"]) == 0.06
    bases = {unit.name: unit.baseUnit for unit in described.unitDefinitions}
    assert (bases["N.m"].kg, bases["N.m"].m, bases["N.m"].s) == (1, 2, -2)
    outputs = [one.variable.name for one in described.outputs]
    assert [one.variable.name for one in described.initialUnknowns] == outputs


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
    all_near(run.steps(COMMANDS, 7.0), wanted, 1e-12, 0)
    assert run.fmu.getBoolean([run.vr["holding"]]) == [stepper.holding]
    assert run.fmu.getInteger([run.vr["band_mode"]]) == [stepper["band_mode"]]
    assert len({tuple(row) for row in wanted}) == len(COMMANDS)


def test_states_are_kept_and_set_back(file):
    """Also in another instance, that began at another time and with other numbers."""
    run = Run(file, start=7.0)
    kept = run.steps(COMMANDS[:3], 7.0)[-1]
    state = run.fmu.getFMUstate()
    data = run.fmu.serializeFMUstate(state)
    first = run.steps(COMMANDS[3:], 7.39)
    run.fmu.setFMUstate(state)
    all_equal(run.steps(COMMANDS[3:], 7.39), first)
    other = Run(file, start=1.0, **{"initial.omega": 12.0})
    other.steps(COMMANDS[:1], 1.0)
    other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(data))
    assert other.get(*OUTPUTS) == kept
    assert other.get("initial.omega") == [24.0]
    all_equal(other.steps(COMMANDS[3:], 7.39), first)


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
    all_near(run.steps(COMMANDS[:2], 7.0), wanted, 1e-12)


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


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"lever": -5.0}, "lever: -5 N is out of range, 0 to 1e+40 N"),
        ({"lever": np.nan}, "lever: "),
        ({"load": -np.inf}, "load: -inf N.m is out of range"),
        ({"brake.pulley.inertia": np.nan}, "brake.pulley.inertia: "),
    ],
)
def test_wrong_values_end_a_simulation_at_once(file, wrong, words):
    """An importer tries a step that is discarded again, also with such a value."""
    said = []
    options = {"stop_time": 1.0, "timeout": 20, "logger": lambda *x: said.append(x)}
    with pytest.raises(fmpy.fmi1.FMICallException, match="error"):
        fmpy.simulate_fmu(str(file), start_values=wrong, **options)
    (text,) = (row[-1].decode() for row in said if b"out of range" in row[-1])
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
    all_near(
        run.steps(COMMANDS, 0.0), of_stepper(sb.with_values(scene, shorter))[1], 1e-12
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
    all_near(steps(COMMANDS[:3], 7.0), wanted[:3], 1e-12)
    kept = fmu.serializeFMUState(fmu.getFMUState())
    all_near(steps(COMMANDS[3:], 7.39), wanted[3:], 1e-12)
    assert fmu.getInt32([vr["event_count"], vr["band_mode"]]) == [
        len(events),
        stepper["band_mode"],
    ]
    assert fmu.getBoolean([vr["holding"]]) == [stepper.holding]
    fmu.setFMUState(fmu.deserializeFMUState(kept))
    all_near(steps(COMMANDS[3:], 7.39), wanted[3:], 1e-12)


def test_without_a_compiler(scene, tmp_path, monkeypatch):
    """Sources alone, which any C compiler makes a binary of."""
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.warns(UserWarning, match="no C compiler was found"):
        file = sb.export.export_fmu(scene, tmp_path / "brake.fmu", "lever")
    monkeypatch.undo()
    folder = fmpy.extract(file, tmp_path / "inside")
    assert not (tmp_path / "inside" / "binaries").exists()
    if COMPILER:
        command = [COMPILER, "-std=c99", "-fsyntax-only", f"{folder}/sources/fmu.c"]
        subprocess.run(command, check=True)


@pytest.mark.parametrize(
    ("name", "options", "path"),
    [
        ("brake.zip", {}, "brake.zip"),
        ("brake.fmu", {"fmi": 4}, "fmi"),
        ("brake.fmu", {"waiting": 0}, "waiting"),
        ("brake.fmu", {"compiler": "nocc"}, "compiler"),
        ("brake.fmu", {"compiler": "false"}, "compiler"),
    ],
)
def test_what_cannot_be_an_fmu(scene, tmp_path, name, options, path):
    (found,) = paths_of(sb.export.export_fmu, scene, tmp_path / name, **options)
    assert found.endswith(path)


def test_command_writes_an_fmu(scene, tmp_path, capsys):
    file = tmp_path / "x.fmu"
    source = str(tmp_path / "brake.toml")
    sb.write_scene(scene, source)
    changed = ("--set", "initial.omega=9")
    assert call(capsys, "export", source, "--fmu", str(file), *changed)[0] == 0
    read = fmpy.read_model_description(file).modelVariables
    (speed,) = (one for one in read if one.name == "initial.omega")
    assert float(speed.start) == 9.0
