"""Error against time of every shipped scene: warm prepared runs at falling tolerances, beside a tight run."""

import dataclasses
import pathlib
from typing import Any

import numpy as np

from benchmarks.timing import interleaved

FOLDER = pathlib.Path(__file__).resolve().parents[1] / "scenarios"
TOLERANCES = tuple(10.0**-k for k in range(4, 12))
QUICK = (1e-4, 1e-7, 1e-10)
TIGHT = 1e-13
_HEAT = "energy.friction_heat"


def scenes() -> list[str]:
    """Names of the files that make one scene; a scene file beside a Python file of its name is the same scene."""
    names = {file.stem: file.name for ending in ("toml", "py") for file in sorted(FOLDER.glob(f"*.{ending}"))}
    return [names[stem] for stem in sorted(names)]


@dataclasses.dataclass(frozen=True)
class Marks:
    """What two runs of a scene are compared by: times at which modes change, friction heat, temperatures at the end."""

    times: np.ndarray
    heat: float
    temperatures: np.ndarray

    @classmethod
    def of(cls, result: Any) -> "Marks":
        rows, last = result.record.rows, int(result.record.count) + 1
        modes, times = np.asarray(rows.mode)[:last], np.asarray(rows.t)[:last]
        changed = np.any(modes[1:] != modes[:-1], axis=1)
        ends = np.zeros(0) if result.scene.heat is None else np.asarray(result.end_temperatures)
        return cls(times[1:][changed], float(result.energy["friction_heat"]), ends)

    def error(self, truth: "Marks") -> float:
        """Largest relative difference; NaN if the modes do not change as often."""
        if len(self.times) != len(truth.times):
            return float("nan")
        mine, theirs = (np.concatenate([m.times, [m.heat], m.temperatures]) for m in (self, truth))
        size = np.where(theirs == 0.0, 1.0, np.abs(theirs))
        return float(np.max(np.abs(mine - theirs) / size))


def measure(name: str, tolerances: tuple[float, ...], budget: float) -> dict[str, Any]:
    """Points of one scene with the method that it gets by default."""
    import simbrake as sb
    from simbrake._run._simulate import solver_name

    scene = sb.files.open_scene(FOLDER / name)
    truth = Marks.of(sb.simulate(scene, rtol=TIGHT))
    # room for the steps of the tightest of them
    run, rows = sb.prepare(scene, [_HEAT], rtol=min(tolerances)), []
    for tolerance in tolerances:
        result = sb.simulate(scene, rtol=tolerance, throw=False)
        wrong = Marks.of(result).error(truth) if result.ok else float("nan")
        row = {"tolerance": tolerance, "error": wrong, "steps": int(result.record.count)}
        times = interleaved({"run": lambda tolerance=tolerance: run(rtol=tolerance)}, budget, least=3)["run"]
        rows.append(row | {"seconds": times.cpu_median, "elapsed_seconds": times.median})
    method = solver_name(run.solver)
    return {"name": name, "method": method, "events": len(truth.times), "end": float(scene.end_time), "rows": rows}


def text(scene: dict[str, Any]) -> str:
    """The table of a scene."""
    lines = [f"\n{scene['name']}: {scene['method']}, {scene['events']} changes of modes in {scene['end']:g} s"]
    lines.append(f"{'tolerance':>10}{'error':>10}{'time µs':>11}{'steps':>8}")
    for row in scene["rows"]:
        error = "others" if np.isnan(row["error"]) else f"{row['error']:.1e}"
        lines.append(f"{row['tolerance']:10.0e}{error:>10}{1e6 * row['seconds']:11.0f}{row['steps']:>8}")
    return "\n".join(lines)
