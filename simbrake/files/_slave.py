"""What runs inside an FMU of `write_fmu`: a `Stepper` behind the functions of FMI 2.0. It is copied into the FMU."""

import json
import uuid
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real
from pythonfmu.enums import Fmi2Status

_INPUT, _PARAMETER, _OUTPUT = Fmi2Causality.input, Fmi2Causality.parameter, Fmi2Causality.output


class Brake(Fmi2Slave):
    """The brake of the scene beside this file, with the variables of `variables.json`.

    Values of inputs are held from the next step on; outputs are those at the end of the last step. A step that fails is
    discarded, with the reason in the log and the state as it was.
    """

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        folder = Path(str(self.resources))
        self.scene, model = folder / "scene.toml", json.loads((folder / "variables.json").read_text("utf-8"))
        self.about, self.units = model["variables"], model["units"]
        self.description, self.tool = model["description"], model["tool"]
        self.guid = uuid.uuid5(uuid.NAMESPACE_URL, self.scene.read_text("utf-8") + json.dumps(model))
        self.values: dict[str, float] = {}  # of parameters and inputs, where they were set
        self.stepper: Any = None
        self.offset, self.seen = 0.0, None
        for variable in self.about:
            self._add(variable)

    def _add(self, variable: dict[str, Any]) -> None:
        """Register a variable."""
        name, cause = variable["name"], Fmi2Causality[variable["causality"]]
        kind = {"Real": Real, "Integer": Integer, "Boolean": Boolean}[variable["type"]]
        about = {"causality": cause, "description": variable["description"]}
        if cause == _OUTPUT:
            discrete = {} if kind is Real else {"variability": Fmi2Variability.discrete}
            self.register_variable(kind(name, getter=lambda: self._output(name), **about, **discrete), nested=False)
            return
        fixed = {"variability": Fmi2Variability.fixed} if cause == _PARAMETER else {}
        get = lambda: self.values.get(name, variable["start"])  # noqa: E731
        put = lambda value: self.values.__setitem__(name, value)  # noqa: E731
        self.register_variable(kind(name, getter=get, setter=put, **about, **fixed), nested=False)

    def _of(self, cause: Fmi2Causality) -> dict[str, float]:
        """Values that were set, of the inputs or of the parameters."""
        names = {variable["name"] for variable in self.about if variable["causality"] == cause.name}
        return {name: value for name, value in self.values.items() if name in names}

    # --- the description ----------------------------------------------------------------------------------------------

    def to_xml(self, model_options: Any = None) -> Element:
        """The model description, with units and initial unknowns beside what PythonFMU writes."""
        root = super().to_xml(model_options or {})
        root.set("generationTool", self.tool)
        definitions = Element("UnitDefinitions")
        for unit, powers in self.units.items():
            SubElement(SubElement(definitions, "Unit", name=unit), "BaseUnit", {k: str(n) for k, n in powers.items()})
        root.insert(1, definitions)  # after CoSimulation
        about = {entry["name"]: entry for entry in self.about}
        for variable in root.iter("ScalarVariable"):
            described, real = about[variable.get("name", "")], variable.find("Real")
            if real is not None and described["unit"]:
                real.set("unit", described["unit"])
            if real is not None and "start" in described:
                real.set("start", repr(described["start"]))  # 16 digits are not enough
        structure = root.find("ModelStructure")
        outputs = root.find("ModelStructure/Outputs")
        if structure is not None and outputs is not None:
            unknowns = SubElement(structure, "InitialUnknowns")
            for output in outputs:
                SubElement(unknowns, "Unknown", dict(output.attrib))
        return root

    # --- the run ------------------------------------------------------------------------------------------------------

    def _made(self) -> Any:
        """A stepper of the scene with the parameters that were set."""
        try:
            import simbrake as sb
        except ImportError:
            raise self._error("the Python that runs this FMU has no simbrake: pip install simbrake") from None
        values = self._of(_PARAMETER)
        rtol = values.pop("rtol", 1e-10)
        try:
            scene = sb.with_values(sb.read_scene(self.scene), values)
            names = [variable["name"] for variable in self.about if variable["causality"] == _INPUT.name]
            return sb.Stepper(scene, names, rtol=rtol)
        except (sb.InputError, RuntimeError) as error:
            raise self._error(str(error)) from None

    def _error(self, text: str) -> RuntimeError:
        """An error for the log, where `%` has a meaning."""
        return RuntimeError(text.replace("%", "%%"))

    def setup_experiment(self, start_time: float, stop_time: float | None = None, tolerance: Any = None) -> None:
        """The clock of the scene begins with the simulation."""
        self.stepper = self._made()
        self.offset, self.seen = start_time - self.stepper.time, None

    def do_step(self, current_time: float, step_size: float) -> bool:
        """One step under the inputs that are held."""
        now = self.stepper.time + self.offset
        try:
            if abs(current_time - now) > 1e-9 * (1.0 + abs(now)):
                raise RuntimeError(f"the step begins at {current_time!r} s, the brake is at {now!r} s")
            self.stepper.advance(step_size, **self._of(_INPUT))
        except (RuntimeError, ValueError) as error:  # of simbrake: a faulty input, a run that fails with a code
            self.log(str(error).replace("%", "%%"), Fmi2Status.error)
            return False
        self.seen = None
        return True

    def _output(self, name: str) -> float:
        if self.stepper is None:
            return 0.0
        if name == "holding":
            return self.stepper.holding
        if self.seen is None:
            self.seen = self.stepper.series()
        return np.max(getattr(self.seen, name)).item()

    # --- its state ----------------------------------------------------------------------------------------------------

    def _get_fmu_state(self) -> dict[str, Any]:
        state = None if self.stepper is None else {k: x.tolist() for k, x in self.stepper.state().items()}
        return {"values": dict(self.values), "offset": self.offset, "stepper": state}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        before = self._of(_PARAMETER)
        self.values, self.offset, self.seen = dict(state["values"]), state["offset"], None
        if state["stepper"] is None:
            self.stepper = None
            return
        if self.stepper is None or self._of(_PARAMETER) != before:
            self.stepper = self._made()
        self.stepper.restore(state["stepper"])
