"""A stored result, run again."""

from typing import Any

import numpy as np

from .._base._arguments import explained
from .._base._faults import Fault, InputError, input_error
from .._base._part import leaves
from ..files._scene_file import scene_from_text
from ..hybrid import Rodas5P
from ..parts.scene import Scene
from ..runs.edit import with_values
from ..runs.result import Result
from ..runs.simulate import simulate
from .stored import Settings, Source, origin, parts


@explained
def rerun(source: Source, *, scene: Scene | None = None, solver: Any = None) -> Result:
    """Run a stored result again: its scene, with its solver and settings.

    - `source`: a result file, a data set or a `Result`
    - `scene`: needed where the file holds no text of it (a custom law): a scene of the
      same parts, whose parameters are replaced by those stored
    - `solver`: needed where the stored one is no solver of diffrax without options, and
      not `Rodas5P`

    With the same versions on the same machine the result is the same to the last bit. A
    run that fails is returned, as `simulate(..., throw=False)` does. Raises
    `InputError`.

    Example:
        >>> sb.results.rerun(result).status
        'stopped'
    """
    stored = origin(source)
    settings = stored["settings"]
    if scene is not None:
        scene = _filled(scene, stored["scene"])
    elif (text := stored["scene"]["toml"]) is not None:
        scene = scene_from_text(text)
    else:
        hint = "give a scene of the same parts: rerun(…, scene=…)"
        raise input_error(
            "scene", f"is not in the file as text ({stored['scene']['why']})", hint
        )
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


def _filled(scene: Scene, stored: Settings) -> Scene:
    """The scene with the stored numbers, if it is of the stored parts."""
    own = parts(scene)
    theirs = stored["parts"]
    faults = [
        Fault(
            path or "scene",
            f"is {own.get(path)}, in the stored run {theirs.get(path)}",
            "give a scene of its parts",
        )
        for path in sorted(own.keys() | theirs.keys())
        if own.get(path) != theirs.get(path)
    ]
    values = {row["path"]: np.asarray(row["value"], float) for row in stored["numbers"]}
    shapes = {leaf.path: np.shape(leaf.value) for leaf in leaves(scene)}
    for path in sorted(shapes.keys() | values.keys()):
        if path not in shapes or path not in values:
            where = "the stored run" if path in shapes else "the scene given"
            faults.append(
                Fault(path, f"is absent in {where}", "give a scene of its parts")
            )
        elif shapes[path] != values[path].shape:
            what = f"is of shape {shapes[path]}, in the stored run {values[path].shape}"
            faults.append(Fault(path, what, "give a scene of its parts"))
    if faults:
        raise InputError(faults)
    return with_values(scene, values)


def _solver_of(name: str) -> Any:
    if name == "Rodas5P":
        return Rodas5P()
    import diffrax  # here, as only this asks for a solver by the name in a file

    solver = getattr(diffrax, name, None)
    if isinstance(solver, type) and issubclass(solver, diffrax.AbstractERK):
        return solver()
    raise input_error(
        "settings.method",
        f"{name} cannot be made by its name",
        "give it: rerun(…, solver=…)",
    )
