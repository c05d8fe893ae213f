"""Where a result came from: versions, machine, scene and settings, enough to run it again."""

import dataclasses
import importlib
import os
import platform
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import jax
import numpy as np

from .._base._compiling import accelerators, run_device
from .._base._faults import InputError
from .._base._quantity import leaves
from .._parts._scene import Scene, warnings
from .._run._result import Result
from ..files._scene_file import scene_from_text, scene_text

_HOME = "simbrake"
PACKAGES = ("jax", "jaxlib", "diffrax", "equinox", "interpax", "numpy", "scipy")


def provenance(result: Result) -> dict[str, Any]:
    """Where a concrete result came from, as plain values of JSON: no user, host or path is named.

    - `simbrake`, `versions`, `machine`, `date` (UTC, ISO 8601, of this call)
    - `scene`: `toml`, the text of a scene file, or `null` and `why` for a scene that no file can hold, as one with a
      law of one's own; `numbers` (path, value, unit, SI) and `parts` (path → class or word) of any scene
    - `settings`: the options of `simulate`;  `outcome`: status, code and counts of the solver

    `simbrake.results.rerun` runs it again. Raises `ValueError` for a traced or batched result.
    """
    if not result.concrete:
        raise ValueError("a traced or batched result has no provenance: take it of one result outside of jit and vmap")
    stats, limits = result.record.stats, result.limits
    longest = float(limits.max_step)
    return {
        "simbrake": str(importlib.import_module(_HOME).__version__),
        "versions": {"python": platform.python_version(), **{name: _version(name) for name in PACKAGES}},
        "machine": machine(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "scene": scene_dict(result.scene),
        "settings": {
            "method": result.method_name,
            "rtol": float(result.rtol),
            "max_step": longest if np.isfinite(longest) else None,
            "max_steps": limits.max_steps,
            "max_events": int(limits.max_events),
        },
        "outcome": {
            "status": result.status,
            "code": int(result.code),
            "message": result.message,
            "warnings": warnings(result.scene),
            **{name: int(count) for name, count in zip(stats._fields, stats, strict=True)},
        },
    }


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def machine() -> dict[str, Any]:
    """Processor, cores and operating system, and how JAX computes."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = info.read_text("utf-8", errors="replace").splitlines()
        cpu = next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), cpu)
    return {
        "cpu": cpu,
        "architecture": platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "backend": jax.default_backend(),
        "one_function": accelerators(run_device().platform).one_function,
    }


def scene_dict(scene: Scene) -> dict[str, Any]:
    """A scene as text where a scene file can hold it, and its numbers and parts."""
    toml, why = _toml(scene)
    numbers = [
        {"path": leaf.path, "value": np.asarray(leaf.value, float).tolist(), "unit": leaf.about.unit}
        for leaf in leaves(scene)
    ]
    return {"toml": toml, "why": why, "numbers": numbers, "parts": parts(scene)}


def _toml(scene: Scene) -> tuple[str | None, str | None]:
    """The text of a scene file from which the very same scene comes back, or why there is none."""
    try:
        text = scene_text(scene)
        back = scene_from_text(text)
    except InputError as error:
        return None, "; ".join(str(fault) for fault in error.faults)
    same = parts(back) == parts(scene) and all(
        a.path == b.path and np.array_equal(a.value, b.value) for a, b in zip(leaves(back), leaves(scene), strict=True)
    )
    return (text, None) if same else (None, "the text does not give the same scene back")


def parts(node: Any, path: str = "") -> dict[str, Any]:
    """What a scene is made of beside its numbers with units: path → name of the class, or the value of a word or count.

    Classes that are not of simbrake are named with their module.
    """
    found: dict[str, Any] = {}
    if isinstance(node, tuple | list):
        for i, child in enumerate(node):
            found |= parts(child, f"{path}[{i}]")
    elif dataclasses.is_dataclass(node) and not isinstance(node, type):
        found[path] = _name(type(node))
        for field in dataclasses.fields(node):
            value = getattr(node, field.name)
            if "quantity" not in field.metadata or dataclasses.is_dataclass(value):
                found |= parts(value, f"{path}.{field.name}" if path else field.name)
    elif isinstance(node, bool | int | float | str):
        found[path] = node
    elif isinstance(node, np.ndarray | jax.Array):  # numbers of a law of one's own that name no unit
        found[path] = np.asarray(node).tolist()
    elif node is not None:
        found[path] = _name(node if callable(node) else type(node))
    return found


def _name(thing: Any) -> str:
    module, name = getattr(thing, "__module__", ""), getattr(thing, "__qualname__", type(thing).__qualname__)
    return name if str(module).split(".")[0] == _HOME else f"{module}.{name}"
