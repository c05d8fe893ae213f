"""Running a stored result again."""

import json
from pathlib import Path
from typing import Any

import diffrax
import numpy as np

from .._base._faults import Fault, InputError
from .._base._quantity import leaves
from .._files._scene_file import scene_from_text
from .._hybrid import Rodas5P
from .._parts._scene import Scene
from .._run._edit import with_values
from .._run._result import Result
from .._run._simulate import simulate
from ._provenance import parts, provenance
from ._result_file import load


def origin(source: Any) -> dict[str, Any]:
    """What `provenance` said when a result was stored: of a file, a data set, or (now) a result."""
    if isinstance(source, Result):
        return provenance(source)
    data, name = (load(source), str(source)) if isinstance(source, str | Path) else (source, "data set")
    try:
        return json.loads(data.attrs["provenance"])
    except (AttributeError, KeyError, ValueError) as error:
        what = "does not say where it came from"
        raise InputError([Fault(name, what, "give a result file, or a data set of simbrake.dataset")]) from error


def rerun(source: Any, *, scene: Scene | None = None, solver: Any = None) -> Result:
    """Runs a stored result again: its scene, with its solver and settings.

    - `source`: a result file, a data set or a `Result`
    - `scene`: needed where the file holds no text of it (a law of one's own): a scene of the same parts, whose numbers
      are replaced by those stored
    - `solver`: needed where the stored one is no solver of diffrax without options, and not `Rodas5P`

    With the same versions on the same machine the result is the same to the last bit. A run that fails is returned, as
    `simulate(..., throw=False)` does. Raises `InputError`.
    """
    stored = origin(source)
    settings = stored["settings"]
    scene = _scene_of(stored["scene"]) if scene is None else _filled(scene, stored["scene"])
    longest = settings["max_step"]
    return simulate(
        scene,
        solver=solver or _solver_of(settings["method"]),
        rtol=settings["rtol"],
        max_step=np.inf if longest is None else longest,
        max_steps=settings["max_steps"],
        max_events=settings["max_events"],
        throw=False,
    )


def _scene_of(stored: dict[str, Any]) -> Scene:
    if stored["toml"] is None:
        hint = "give a scene of the same parts: rerun(…, scene=…)"
        raise InputError([Fault("scene", f"is not in the file as text ({stored['why']})", hint)])
    return scene_from_text(stored["toml"])


def _filled(scene: Scene, stored: dict[str, Any]) -> Scene:
    """The scene with the stored numbers, if it is of the stored parts."""
    own, theirs = parts(scene), stored["parts"]
    faults = [
        Fault(path or "scene", f"is {own.get(path)}, in the stored run {theirs.get(path)}", "give a scene of its parts")
        for path in sorted(own.keys() | theirs.keys())
        if own.get(path) != theirs.get(path)
    ]
    values = {row["path"]: np.asarray(row["value"], float) for row in stored["numbers"]}
    shapes = {leaf.path: np.shape(leaf.value) for leaf in leaves(scene)}
    for path in sorted(shapes.keys() | values.keys()):
        if path not in shapes or path not in values:
            where = "the stored run" if path in shapes else "the scene given"
            faults.append(Fault(path, f"is absent in {where}", "give a scene of its parts"))
        elif shapes[path] != values[path].shape:
            what = f"is of shape {shapes[path]}, in the stored run {values[path].shape}"
            faults.append(Fault(path, what, "give a scene of its parts"))
    if faults:
        raise InputError(faults)
    return with_values(scene, values)


def _solver_of(name: str) -> Any:
    if name == "Rodas5P":
        return Rodas5P()
    solver = getattr(diffrax, name, None)
    if isinstance(solver, type) and issubclass(solver, diffrax.AbstractERK):
        return solver()
    raise InputError([Fault("settings.method", f"{name} cannot be made by its name", "give it: rerun(…, solver=…)")])
