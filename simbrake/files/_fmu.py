"""A scene as an FMU for co-simulation (FMI 2.0): its `Stepper` under the inputs of another program."""

import importlib
import json
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._base._faults import Fault, InputError, needed, whole_file
from .._outputs._quantities import SERIES_COLUMNS
from .._parts._scene import Scene
from .._run._stepper import Stepper
from ..loads import TorqueLoad
from ._scene_file import leaves, scene_from_text, scene_text

#: outputs of several values, of which the maximum is given
_MAXIMA = (
    *("rim_temperature", "lining_temperature", "band_temperature", "lining_outer_temperature"),
    *("wetted_temperature", "coolant_temperature", "coolant_heat_flow"),
)
_LEFT_OUT = ("t", "holding_reserve")  # (of a pulley that turns it is not a number)
#: units of FMI by their powers of base units
_BASE = {
    "N": {"kg": 1, "m": 1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    **{name: {name: 1} for name in ("kg", "m", "s", "K", "rad")},
}


def write_fmu(scene: Scene, path: str | Path, inputs: Sequence[str] | str | None = None) -> Path:
    """Write a scene as an FMU, co-simulation 2.0; it needs Python with simbrake where it runs.

    - `inputs`: those of `Stepper`; by default the lever, and the load where that is a `TorqueLoad`
    - outputs: `omega`, `phi`, `brake_torque`, tensions and all other columns of `Series` that are one number, the
      maximum of each temperature; `band_mode`; `holding`. In SI, with units in the model description
    - parameters: every single number of the scene by its path, and `rtol`

    Equal commands give the numbers of a `Stepper` to the last bit. Its state can be kept, set back and serialized.
    A step that fails is discarded, its reason in the log, and the state is what it was.

    Raises `InputError` for a scene that cannot be written or stepped, and without PythonFMU (`simbrake[fmu]`).
    """
    path = Path(path)
    if path.suffix != ".fmu":
        raise InputError([Fault(str(path), f"has the ending {path.suffix!r}", "give a name with .fmu")])
    needed("pythonfmu", "writes FMUs", "fmu")
    if inputs is None:
        inputs = ["lever", "load"] if isinstance(scene.duty.load, TorqueLoad) else ["lever"]
    text = scene_text(scene)
    stepper = Stepper(scene_from_text(text), inputs)
    with tempfile.TemporaryDirectory() as folder, whole_file(path) as target:
        scratch = Path(folder)
        script, files = scratch / "brake_fmu.py", [scratch / "variables.json", scratch / "scene.toml"]
        shutil.copy(Path(__file__).with_name("_slave.py"), script)
        (scratch / "variables.json").write_text(json.dumps(_described(stepper)), "utf-8")
        (scratch / "scene.toml").write_text(text, "utf-8")
        before = list(sys.path)
        try:
            builder = importlib.import_module("pythonfmu.builder").FmuBuilder
            states = {"canGetAndSetFMUstate": True, "canSerializeFMUstate": True}
            builder.build_FMU(script, dest=target, project_files=files, **states)
        finally:  # where it looked for the script
            sys.path[:] = before
            sys.modules.pop(script.stem, None)
    return path


def _described(stepper: Stepper) -> dict[str, Any]:
    """The variables of the FMU, their units, and what it says of itself."""
    scene, now = stepper.scene, stepper.series()
    variables = []

    def add(name: str, causality: str, unit: str, meaning: str, kind: str = "Real", **more: Any) -> None:
        unit = "" if unit in ("", "1") else unit.replace("*", ".").replace("^", "")
        variables.append(
            {"name": name, "causality": causality, "type": kind, "unit": unit, "description": meaning, **more}
        )

    for name, unit in stepper.units.items():
        add(name, "input", unit, f"{name}, held from one step to the next", start=stepper.inputs[name])
    for name, about in SERIES_COLUMNS.items():
        value = getattr(now, name)
        if value is None or name in _LEFT_OUT or (np.ndim(value) > 1 and name not in _MAXIMA):
            continue
        kind = "Integer" if np.issubdtype(np.asarray(value).dtype, np.integer) else "Real"
        most = "maximum: " if np.ndim(value) > 1 else ""
        add(name, "output", about.unit, most + about.meaning, kind)
    add("holding", "output", "", "whether the brake holds the pulley at rest", "Boolean")
    for leaf in leaves(scene):
        if np.ndim(leaf.value) == 0:
            add(leaf.path, "parameter", leaf.about.unit, leaf.about.meaning, start=float(leaf.value))
    add("rtol", "parameter", "", "relative tolerance of the integration", start=float(stepper.rtol))
    version = importlib.import_module("simbrake").__version__
    return {
        "variables": variables,
        "units": {variable["unit"]: _powers(variable["unit"]) for variable in variables if variable["unit"]},
        "description": f"{scene.brake.kind}; needs Python with simbrake {version} where it runs",
        "tool": f"simbrake {version} with PythonFMU",
    }


def _powers(unit: str) -> dict[str, int]:
    """Powers of the base units of a unit as `kg.m2` or `W/(m.K)`."""
    powers: dict[str, int] = {}
    above, _, below = unit.partition("/")
    for part, sign in ((above, 1), (below.strip("()"), -1)):
        for factor in filter(None, part.split(".")):
            name, power = (factor[:-1], int(factor[-1])) if factor[-1].isdigit() and len(factor) > 1 else (factor, 1)
            for base, n in _BASE.get(name, {}).items():
                powers[base] = powers.get(base, 0) + sign * power * n
    return powers
