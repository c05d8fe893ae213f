"""Time to the first result of a fresh process, in units of importing jax and diffrax."""

import json
import statistics
import tempfile
from typing import Any, NamedTuple

from benchmarks.parts.processes import fresh
from benchmarks.parts.table import Column, Part, Target
from benchmarks.scenes import CASES, closed_form

NAME = "first"
TITLE = "a fresh process up to its first result"

COLUMNS = (
    Column("what", ""),
    Column("error", "error", ".1e"),
    Column("seconds", "s", ".2f"),
    Column("least", "least", ".2f"),
    Column("cpu", "CPU s", ".2f"),
    Column("ratio", "in bare imports", ".2f"),
    Column("imports", "import s", ".2f"),
    Column("trace", "trace s", ".2f"),
    Column("compile", "compile s", ".2f"),
    Column("run", "run s", ".3f"),
)

_CLOCK = """
import json, time
def now():
    return time.time(), time.process_time()
"""

_BARE = (
    _CLOCK
    + """
import jax, diffrax
print(json.dumps({"first": now()}))
"""
)

#: modules are loaded with the names that are used
_IMPORT = (
    _CLOCK
    + """
import simbrake as sb
sb.Scene, sb.Brake, sb.Pulley, sb.Band, sb.Lining, sb.ConstantFriction, sb.Duty, sb.Initial, sb.simulate
print(json.dumps({"first": now()}))
"""
)

#: the first result and what it consists of; a tight run of the same program tells its error
_SCENE = (
    _CLOCK
    + """
import jax
import simbrake as sb
sb.Scene, sb.simulate
imported = now()
compiled = []
def listen(event, seconds, **_):
    if event in ("/jax/core/compile/backend_compile_duration", "/jax/compilation_cache/cache_retrieval_time_sec"):
        compiled.append((event, seconds))
jax.monitoring.register_event_duration_secs_listener(listen)
scene = {scene}
print(sb.simulate(scene))
first = now()
making = max(sum(s for e, s in compiled if e.startswith(kind)) for kind in ("/jax/core", "/jax/compilation_cache"))
again = now()
print(sb.simulate(scene))
warm = now()[0] - again[0]
result = sb.simulate(scene)
tight = sb.simulate(scene, rtol=1e-13)
print(json.dumps({{"first": first, "import": imported, "compile": making, "run": warm,
    "stop": float(result.stopping_time), "tight": float(tight.stopping_time)}}))
"""
)

_STOP = """sb.Scene(
    sb.Brake(sb.Pulley(0.725, 800.0), sb.Band(0.725, 2e5), sb.Lining(sb.ConstantFriction(0.35), [{beta!r}] * 20)),
    sb.Duty(sb.Constant(8e3), sb.TorqueLoad()),
    sb.Initial(20.0),
    1.0,
)"""

_STAGED = """sb.Scene(
    sb.Brake(
        sb.Pulley(0.59, 1200.0),
        sb.Band(0.638),
        sb.Lining(sb.friction.ProductFriction(0.42, (sb.LinearFade(4e-4, 293.15),)), [{beta!r}] * 20),
        sb.Bandage(60.0, sb.friction.ProductFriction(0.30, (sb.LinearFade(4e-4, 293.15),)), 4e3),
    ),
    sb.Duty(sb.profiles.ExponentialRise(24e3, 0.25, -0.02), sb.TorqueLoad(sb.Constant(3e3))),
    sb.Initial(24.0),
    4.0,
    sb.thermal.with_external_pair(
        sb.lumped_heat(
            rim=4e4, linings=6e3, band=9e3, lining_to_band=30.0, rim_cooling=15.0, band_cooling=5.0,
            partition=sb.thermal.ConstantPartition(0.7),
        ),
        sb.thermal.ConstantPartition(0.5),
        rim_share=0.1,
    ),
)"""


class First(NamedTuple):
    """One process: seconds to the first result, processor seconds, and what the process says of itself."""

    seconds: float
    cpu: float
    said: dict[str, Any]
    began: float


def process(program: str, cache: str | None) -> First:
    """Runs a program in a fresh process; `cache`: the folder for compiled programs."""
    done = fresh(["-c", program], cache)
    said = json.loads(done.out.splitlines()[-1])
    end, cpu = said["first"]
    return First(end - done.began, cpu, said, done.began)


def scripts() -> dict[str, str]:
    """The two scenes as programs."""
    import math

    beta = math.radians(13.5)
    scenes = {"(a) stop": _STOP, "staged with lumps": _STAGED}
    return {name: _SCENE.format(scene=scene.format(beta=beta)) for name, scene in scenes.items()}


def _row(what: str, firsts: list[First], bare: list[First]) -> dict[str, Any]:
    row: dict[str, Any] = {"what": what, "seconds": statistics.median(f.seconds for f in firsts)}
    row |= {"least": min(f.seconds for f in firsts), "cpu": statistics.median(f.cpu for f in firsts)}
    # processes of one round met the same other work
    row["ratio"] = statistics.median(f.cpu / b.cpu for f, b in zip(firsts, bare, strict=True))
    parts = [f for f in firsts if "run" in f.said]
    if parts:
        row["imports"] = statistics.median(f.said["import"][0] - f.began for f in parts)
        for name in ("compile", "run"):
            row[name] = statistics.median(f.said[name] for f in parts)
        row["trace"] = row["seconds"] - row["imports"] - row["compile"] - row["run"]
    return row


def measure(quick: bool, rounds: int = 5) -> Part:
    """All processes in turn, round after round; `quick`: one round of the short scene."""
    programs = dict(list(scripts().items())[:1]) if quick else scripts()
    found: dict[str, list[First]] = {}
    for _ in range(1 if quick else rounds):
        turn = {"import jax, diffrax": process(_BARE, None), "import simbrake": process(_IMPORT, None)}
        for name, script in programs.items():
            with tempfile.TemporaryDirectory() as cache:
                turn[f"{name}, cold"] = process(script, cache)
                turn[f"{name}, warm cache"] = process(script, cache)
        for name, first in turn.items():
            found.setdefault(name, []).append(first)
    bare = found["import jax, diffrax"]
    rows = [_row(name, firsts, bare) for name, firsts in found.items()]
    for row in rows:
        said = found[row["what"]][0].said
        if "stop" in said:
            truth = closed_form(CASES["a"].plain).times[-1] if row["what"].startswith("(a)") else said["tight"]
            row["error"] = abs(said["stop"] / truth - 1)
    limits = {
        "import simbrake": 1.3,
        "(a) stop, cold": 2.5,
        "(a) stop, warm cache": 1.8,
        "staged with lumps, cold": 4.0,
    }
    targets = [
        Target(f"{r['what']}, in bare imports", limits[r["what"]], r["ratio"]) for r in rows if r["what"] in limits
    ]
    notes = [
        "import simbrake: and the names that a scene without heat and its run use, as modules are loaded with them",
        "ratio: of processor time up to the printed result, median over rounds of one process each",
        "cache: the folder of compiled programs, as the command line has it, empty before the first process",
        "error: of the stopping time at the tolerance by default, against the closed form, or against a run at 1e-13",
        "trace: what is neither import nor compilation nor a warm run",
    ]
    return Part(NAME, TITLE, COLUMNS, rows, targets, notes)
