"""A scene as an FMU for co-simulation: C that steps it under the inputs of another
program."""

import collections
import dataclasses
import importlib.util
import math
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
import uuid
import warnings
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from .._base._faults import Issues, input_error, whole_file
from .._base._quantity import Quantity, shown
from ..outputs.quantities import SERIES_COLUMNS
from ..parts.scene import Scene
from ..parts.scene_checks import checked
from ._c_export import (
    Export,
    c_name,
    c_text,
    check_waiting,
    possible_inputs,
    program_version,
    range_of,
)
from .stepper import HeldInput, held_inputs

#: outputs of several values, of which the maximum is given
_MAXIMA = (
    "rim_temperature",
    "lining_temperature",
    "band_temperature",
    "lining_outer_temperature",
    "wetted_temperature",
    "coolant_temperature",
    "coolant_heat_flow",
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


def export_fmu(
    scene: Scene,
    path: str | Path,
    inputs: Sequence[str] | str | None = None,
    *,
    fmi: int = 2,
    waiting: int = 64,
    compiler: str | None = None,
) -> Path:
    """Write a scene as an FMU for co-simulation that needs nothing where it runs: C,
    and its binary.

    - `inputs`: those of `Stepper`; by default lever and load, as far as the scene can
      have them
    - outputs: `omega`, `phi`, `brake_torque`, tensions and all other columns of
      `Series` that are one number, the maximum of each temperature; `band_mode`;
      `holding`; `event_count`, and number and time of the `last_event`
    - parameters: every number of the scene by its path, one by one, and `rtol`; they
      are fixed once initialized. Structure, method and numbers of parts are those of
      the scene given
    - `fmi`: 2 or 3, for FMI 2.0 or 3.0
    - `waiting`: how many commands can wait in a dead time (a step takes longer with
      more)
    - `compiler`: C compiler; by default that of the variable CC, cc, gcc, clang or the
      one of `ziglang`

    Events fall at their times within a step, and are in the log. The numbers are those
    of a `Stepper` within rounding. The state can be kept, set back and serialized. A
    step that fails leaves the state as it was, and its reason in the log. It is an
    error; where it had too many events for one step, it is discarded, and a shorter one
    may do. Where no compiler is found, the file has the sources alone, and a warning
    says so: other programs compile them.

    Raises `InputError` for a scene that cannot be written or stepped, and for a
    compiler that fails.

    Example:
        >>> try:
        ...     sb.export.export_fmu(scene, "brake.zip")
        ... except sb.InputError as error:
        ...     print(error.faults[0].hint)
        give a name with .fmu
    """
    path = Path(path)
    issues = Issues()
    if path.suffix != ".fmu":
        what = f"has the ending {path.suffix!r}"
        issues.add(str(path), what, "give a name with .fmu")
    issues.attempt(check_waiting, waiting)
    if fmi not in (2, 3):
        issues.add("fmi", f"{shown(fmi)} is no version of FMI here", "give 2 or 3")
    whole = issues.attempt(checked, scene)
    held = None
    if whole is not None:
        inputs = possible_inputs(whole) if inputs is None else inputs
        held = issues.attempt(held_inputs, whole, [] if inputs is None else inputs)
    issues.report()
    assert whole is not None
    assert held is not None
    name = c_name(path)
    export = Export(name, whole, held, waiting=waiting)
    text = c_text(export)
    variables = _variables(held, export)
    token = str(uuid.uuid5(uuid.NAMESPACE_URL, text + repr(variables)))
    command = _compiler(compiler)
    with tempfile.TemporaryDirectory() as folder, whole_file(path) as target:
        scratch = Path(folder)
        for place in ("sources", "resources", "binaries"):
            (scratch / place).mkdir()
        (scratch / "sources" / f"{name}.c").write_text(text, "utf-8")
        (scratch / "sources" / "variables.h").write_text(
            _c_variables(name, variables, token, export, fmi), "utf-8"
        )
        shutil.copy(Path(__file__).with_name("fmu.c"), scratch / "sources" / "fmu.c")
        if fmi == 3:
            (scratch / "sources" / "buildDescription.xml").write_bytes(
                _build_description(name)
            )
        (scratch / "modelDescription.xml").write_bytes(
            _model_description(name, whole, variables, token, fmi)
        )
        if command is None:
            (scratch / "binaries").rmdir()
            warnings.warn(
                f"no C compiler was found: {path} has its sources alone",
                UserWarning,
                stacklevel=2,
            )
        else:
            _compile(command, scratch, name, fmi)
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in sorted(scratch.rglob("*")):
                archive.write(file, file.relative_to(scratch))
    return path


# --- variables ----------------------------------------------------------------------


@dataclasses.dataclass
class _Variable:
    """A variable of an FMU; `first`, `size`: its place among the numbers, inputs or
    columns of a C file."""

    name: str
    causality: str
    about: Quantity
    type: str = "Real"
    start: float | None = None
    first: int = 0
    size: int = 1
    kind: str = "COLUMN"

    @property
    def unit(self) -> str:
        unit = self.about.unit
        return "" if unit in ("", "1") else unit.replace("*", ".").replace("^", "")

    @property
    def variability(self) -> str:
        return (
            "fixed"
            if self.causality == "parameter"
            else "continuous"
            if self.type == "Real"
            else "discrete"
        )


def _variables(held: Mapping[str, HeldInput], export: Export) -> list[_Variable]:
    """Inputs, the columns that are outputs, outputs that tell of events, parameters."""
    variables = []
    first = 0
    for place, (name, held_input) in enumerate(held.items()):
        low = 0.0 if held_input.unit == "N" else None
        about = Quantity(
            held_input.unit, f"{name}, held from one step to the next", low=low
        )
        variables.append(
            _Variable(
                name, "input", about, start=held_input.level, first=place, kind="INPUT"
            )
        )
    for name, column in export.columns.items():
        size = math.prod(column.shape)
        several = len(column.shape) > 1
        if name not in _LEFT_OUT and (not several or name in _MAXIMA):
            kind = "Integer" if np.issubdtype(column.dtype, np.integer) else "Real"
            about = SERIES_COLUMNS[name]
            about = Quantity(about.unit, "maximum: " * several + about.meaning)
            variables.append(
                _Variable(name, "output", about, kind, first=first, size=size)
            )
        first += size
    about = Quantity("1", "whether the brake holds the pulley at rest")
    variables.append(_Variable("holding", "output", about, "Boolean", kind="HOLDING"))
    for leaf in export.placed:
        for at, place in np.ndenumerate(leaf.value):
            path = leaf.path + "".join(f"[{i}]" for i in at)
            value = float(export.numbers[int(place)])
            if math.isfinite(value):
                parameter = _Variable(
                    path,
                    "parameter",
                    leaf.about,
                    start=value,
                    first=int(place),
                    kind="PARAMETER",
                )
                variables.append(parameter)
    about = Quantity("1", "relative tolerance of the integration", low=1e-15, high=0.1)
    variables.append(
        _Variable("rtol", "parameter", about, start=export.rtol, kind="TOLERANCE")
    )
    names = ", ".join(f"{i} {name}" for i, name in enumerate(export.events, start=1))
    for name, unit, meaning, kind in (
        ("event_count", "1", "events since the start", "Integer"),
        ("last_event", "1", f"the last event: {names}; 0: there was none", "Integer"),
        ("last_event_time", "s", "when it was; -1: there was none", "Real"),
    ):
        variables.append(
            _Variable(name, "output", Quantity(unit, meaning), kind, kind=name.upper())
        )
    return variables


# --- files of an FMU ----------------------------------------------------------------


def _compiler(named: str | None) -> list[str] | None:
    """The command of a C compiler."""
    command = named or os.environ.get("CC")
    if command and (parts := shlex.split(command)):
        if shutil.which(parts[0]) is None:
            raise input_error(
                "compiler",
                f"{parts[0]} is not there",
                "name a C compiler, or leave it out",
            )
        return parts
    found = next(
        (compiler for compiler in ("cc", "gcc", "clang") if shutil.which(compiler)),
        None,
    )
    if found is None and importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    return None if found is None else [found]


def _compile(command: list[str], folder: Path, name: str, fmi: int) -> None:
    """The binary for this machine, in its place."""
    system, ending, *flags = {
        "linux": ("linux", ".so", "-fPIC", "-fvisibility=hidden"),
        "darwin": ("darwin", ".dylib", "-fPIC", "-fvisibility=hidden"),
        "win32": ("win", ".dll"),
    }[sys.platform]
    if fmi == 2:
        place = f"{system}{64 if sys.maxsize > 2**32 else 32}"
    else:
        machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(
            platform.machine().lower(), platform.machine().lower()
        )
        place = f"{machine}-{ {'win': 'windows'}.get(system, system) }"
    binaries = folder / "binaries" / place
    binaries.mkdir()
    flags += ["-O2", "-std=c99", "-ffp-contract=off", "-shared"]
    call = [
        *command,
        *flags,
        "-o",
        str(binaries / f"{name}{ending}"),
        str(folder / "sources" / "fmu.c"),
        "-lm",
    ]
    done = subprocess.run(call, capture_output=True, text=True)
    if done.returncode:
        output = (done.stderr or done.stdout).strip().splitlines()
        first = next(
            (line for line in output if "error" in line),
            output[-1] if output else "without a word",
        )
        raise input_error(
            "compiler", f"{command[0]} failed: {first}", "name another C compiler"
        )


def _c_variables(
    name: str, variables: Sequence[_Variable], token: str, export: Export, fmi: int
) -> str:
    """What the functions of FMI have to know of a scene."""
    rows = []
    for variable in variables:
        low, high = range_of(variable.about)
        unit = variable.unit and f" {variable.unit}"
        rows.append(
            f'  {{{variable.kind}, {variable.first}, {variable.size}, {low!r}, {high!r}, "{variable.name}", "{unit}"}},'
        )
    rows.append('  {TIME, 0, 1, 0, 0, "time", " s"},')
    starts = (
        ", ".join(
            repr(variable.start)
            for variable in variables
            if variable.causality == "input"
        )
        or "0"
    )
    return "\n".join(
        [
            f"#define NAME(x) {name}_##x",
            f"#define UPPER(x) {name.upper()}_##x",
            f'#define TOKEN "{token}"',
            f"#define RTOL {export.rtol!r}",
            f"#define FMI_VERSION {fmi}",
            f'#include "{name}.c"',
            f"static const double input_starts[] = {{{starts}}};",
            "static const variable variables[] = {",
            *rows,
            "};",
            "",
        ]
    )


def _model_description(
    name: str, scene: Scene, variables: Sequence[_Variable], token: str, fmi: int
) -> bytes:
    """The model description of FMI 2.0 or 3.0."""
    marked, state = (
        ("guid", "FMUstate") if fmi == 2 else ("instantiationToken", "FMUState")
    )
    attributes = {
        "fmiVersion": f"{fmi}.0",
        "modelName": name,
        marked: token,
        "description": f"{scene.brake.kind}, without dependencies",
        "generationTool": f"simbrake {program_version()}",
        "variableNamingConvention": "structured",
    }
    root = Element("fmiModelDescription", attributes)
    able = ["canHandleVariableCommunicationStepSize"]
    able += ["canNotUseMemoryManagementFunctions"] * (fmi == 2)
    able += [f"canGetAndSet{state}", f"canSerialize{state}"]
    about = SubElement(
        root, "CoSimulation", {"modelIdentifier": name, **dict.fromkeys(able, "true")}
    )
    if fmi == 2:
        root.set("numberOfEventIndicators", "0")
        SubElement(SubElement(about, "SourceFiles"), "File", name="fmu.c")
    if units := dict.fromkeys(variable.unit for variable in variables if variable.unit):
        definitions = SubElement(root, "UnitDefinitions")
        for unit in units:
            SubElement(
                SubElement(definitions, "Unit", name=unit), "BaseUnit", _powers(unit)
            )
    categories = SubElement(root, "LogCategories")
    for category in ("logEvents", "logStatusDiscard", "logStatusError"):
        SubElement(categories, "Category", name=category)
    SubElement(
        root,
        "DefaultExperiment",
        startTime="0",
        stopTime=repr(float(scene.end_time)),
    )
    described = SubElement(root, "ModelVariables")
    types = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}
    for place, variable in enumerate(variables):
        entry = SubElement(
            described,
            "ScalarVariable" if fmi == 2 else types[variable.type],
            name=variable.name,
            valueReference=str(place),
            description=variable.about.meaning,
            causality=variable.causality,
            variability=variable.variability,
        )
        if variable.causality == "output":
            entry.set("initial", "calculated")
        if fmi == 2:
            entry = SubElement(entry, variable.type)
        if variable.unit:
            entry.set("unit", variable.unit)
        if variable.start is not None:
            entry.set("start", repr(variable.start))
            for bound, limit in (
                ("min", variable.about.low),
                ("max", variable.about.high),
            ):
                if limit is not None:
                    entry.set(bound, repr(float(limit)))
    structure = Element("ModelStructure")
    outputs = [
        i for i, variable in enumerate(variables) if variable.causality == "output"
    ]
    if fmi == 2:
        for part in ("Outputs", "InitialUnknowns"):
            unknowns = SubElement(structure, part)
            for place in outputs:
                SubElement(unknowns, "Unknown", index=str(place + 1))
    else:
        last = str(len(variables))
        clock = {
            "name": "time",
            "valueReference": last,
            "causality": "independent",
            "variability": "continuous",
        }
        SubElement(described, "Float64", clock)
        for part in ("Output", "InitialUnknown"):
            for place in outputs:
                SubElement(structure, part, valueReference=str(place))
    root.append(structure)
    return _xml(root)


def _build_description(name: str) -> bytes:
    """What an FMU of FMI 3.0 is built of."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    sources = SubElement(
        SubElement(root, "BuildConfiguration", modelIdentifier=name),
        "SourceFileSet",
        language="C99",
    )
    SubElement(sources, "SourceFile", name="fmu.c")
    return _xml(root)


def _xml(root: Element) -> bytes:
    indent(root)
    return tostring(root, "UTF-8", xml_declaration=True)


def _powers(unit: str) -> dict[str, str]:
    """Powers of the base units of a unit as `kg.m2` or `W/(m.K)`."""
    powers = collections.defaultdict[str, int](int)
    above, _, below = unit.partition("/")
    for part, sign in ((above, 1), (below.strip("()"), -1)):
        for factor in filter(None, part.split(".")):
            name, power = (
                (factor[:-1], int(factor[-1]))
                if factor[-1].isdigit() and len(factor) > 1
                else (factor, 1)
            )
            for base, n in _BASE.get(name, {}).items():
                powers[base] += sign * power * n
    return {base: str(power) for base, power in powers.items()}
