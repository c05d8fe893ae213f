"""How large the programs of runs are, and beside every size the processor time that it costs.

`python benchmarks/size.py [--scene a --scene b …] [--count] [--json]`

- **Equations** of what a scene gives to the integrator, and of the whole run, with calls inlined and duplicate and dead
  equations removed (`benchmarks/counting.py`): those that a compiler has to deal with. In the parts the numbers of the
  scene are constants, in the run they are arguments, as in the program that `simulate` compiles.
- **Lines** of StableHLO and **instructions** of the compiled program, compiled as `simulate` does it.
- **Processor time** to trace the run, to lower and compile it, and of warm calls, prepared runs too: every scene in
  a fresh process, without a cache of compiled programs. An equation less is no gain if one of these rises.

The one-state system is what the integrator costs alone. `--count` counts equations and lines only and compiles no run.
"""

import argparse
import concurrent.futures
import functools
import json
import multiprocessing
import os
import pathlib
import runpy
import sys
import time
from collections.abc import Callable
from typing import Any, NamedTuple

os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ["SIMBRAKE_CACHE_DIR"] = ""  # what is compiled here is compiled anew
ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import diffrax  # noqa: E402
import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402

import simbrake as sb  # noqa: E402
from benchmarks.counting import size  # noqa: E402
from benchmarks.parts.timing import interleaved  # noqa: E402
from benchmarks.scenes import CASES  # noqa: E402
from simbrake._base._compiling import accelerators, compiled, pack  # noqa: E402
from simbrake._physics._assemble import assemble  # noqa: E402
from simbrake._run._simulate import STRETCH, method_of, run_of_numbers, solver_of  # noqa: E402
from simbrake.hybrid import AbstractHybridSystem, ExplicitRungeKutta, Settings, hybridsolve  # noqa: E402
from simbrake.hybrid._system import Flat, flatten, pack_mode, ravel  # noqa: E402

RTOL = 1e-10
ONE_STATE = "one state"


class Shaft(AbstractHybridSystem):
    """One state, one guard: a shaft slowed by a constant and a viscous torque, at rest in mode 1."""

    constant: Any  # rad/s²
    viscous: Any  # 1/s

    def rhs(self, t, y, mode):
        return jnp.where(mode == 0, -(self.constant + self.viscous * y), 0.0)

    def guards(self, t, y, mode):
        return jnp.where(mode == 0, y, 1.0)[None]

    def transition(self, t, y, mode, fired, at_stop):
        return jnp.where(fired[0], 1, mode), 0

    def reset(self, t, y, before, after):
        return jnp.where(after == 1, 0.0, y)

    def next_stop(self, mode):
        return jnp.inf

    def scales(self):
        return np.asarray(1.0)


class Programs(NamedTuple):
    """What is counted: a system with a state and a mode of it, and its run as a function of a vector of numbers."""

    flat: Flat
    y: np.ndarray
    mode: np.ndarray
    run: Callable[[Any], Any]
    numbers: np.ndarray


class Subject(NamedTuple):
    """A scene, the method of its run (`None`: the one that `simulate` chooses), and room for its attempts."""

    title: str
    scene: Callable[[], sb.Scene]
    solver: Any
    room: int = STRETCH

    def programs(self) -> Programs:
        scene = self.scene()
        numbers, packing = pack((scene, np.asarray(RTOL), np.asarray(np.inf), np.asarray(self.room, np.int32)))
        run = run_of_numbers(packing, method_of(scene, solver_of(scene, self.solver)), self.room)
        return Programs(*_flat(*assemble(scene)), run, numbers)


def _flat(system: AbstractHybridSystem, state: Any, mode: Any) -> tuple[Flat, np.ndarray, np.ndarray]:
    flat = flatten(system, jax.tree.map(np.asarray, state), jax.tree.map(np.asarray, mode))
    return flat, np.asarray(ravel(state, jnp.float64)), np.asarray(pack_mode(mode))


def _one_state() -> Programs:
    def run(numbers: Any) -> Any:
        constant, viscous, y, end, rtol = numbers
        settings = Settings(rtol, np.asarray(10_000, np.int32), max_steps=STRETCH, guard_samples=0)
        method = ExplicitRungeKutta(diffrax.Dopri8())
        return hybridsolve(Shaft(constant, viscous), y, np.int32(0), 0.0, end, method, settings)

    numbers = np.asarray([2.0, 0.1, 20.0, 20.0, RTOL])
    return Programs(*_flat(Shaft(2.0, 0.1), np.asarray(20.0), np.int32(0)), run, numbers)


def _case(name: str, solver: Any) -> Subject:
    return Subject(CASES[name].title, CASES[name].simbrake, solver)


def _scenario(name: str, title: str, solver: Any = None, room: int = STRETCH) -> Subject:
    scene = functools.cache(lambda: runpy.run_path(str(ROOT / "scenarios" / f"{name}.py"))["scene"]())
    return Subject(title, scene, solver, room)


#: every kind of brake that has a system of equations of its own, rigid bands with all methods; loads and duties
SCENES: dict[str, Subject] = {
    "a": _case("a", diffrax.Dopri8()),
    "b": _case("b", diffrax.Tsit5()),
    "c": _case("c", sb.hybrid.Rodas5P()),
    "d": _case("d", diffrax.Dopri8()),
    "e": _case("e", diffrax.Dopri8()),
    "everything": _scenario("everything_coupled", "staged brake with all that can be coupled", diffrax.Dopri8()),
    "bandage": _scenario(
        "resolved_bandage", "staged brake lining by lining, springs between linings", diffrax.Dopri8()
    ),
    "disc": _scenario("disc_stop", "disc brake with heat and fade"),
    "shoes": _scenario("double_shoe_stop", "double-shoe brake"),
    "bands": _scenario("unequal_bands", "two bands that differ, a rim each"),
    "lowering": _scenario("drag_lowering", "a load lowered at a given speed, with heat and fade"),
    "stands": _scenario("tripping_30_stands", "thirty stands in phases, walls, contacts that open", room=16_384),
}


def programs_of(name: str) -> Programs:
    """The programs of a scene, or of the one-state system."""
    return _one_state() if name == ONE_STATE else SCENES[name].programs()


def counts(programs: Programs) -> dict[str, int]:
    """Equations of the parts and of the run."""
    flat, y, mode = programs.flat, programs.y, programs.mode
    t, stop = np.asarray(0.0), np.asarray(False)
    fired = np.zeros(jax.eval_shape(flat.guards, t, y, mode).shape, bool)

    def both(t, y, mode):
        return flat.rhs(t, y, mode), flat.guards(t, y, mode)

    def with_rates(t, y, mode):
        f = flat.rhs(t, y, mode)
        return f, jax.jvp(lambda t, y: flat.guards(t, y, mode), (t, y), (jnp.ones_like(t), f))

    def transition(t, y, mode, fired, stop):
        return flat.jump(t, y, mode, fired, stop)[1:]

    rhs = size(flat.rhs, t, y, mode)
    return {
        "rhs": rhs,
        "guards": size(flat.guards, t, y, mode),
        "guards beyond rhs": size(both, t, y, mode) - rhs,
        "rhs, guards, rates": size(with_rates, t, y, mode),
        "transition": size(transition, t, y, mode, fired, stop),
        "reset": size(flat.reset, t, y, mode, mode),
        "transition, reset": size(flat.jump, t, y, mode, fired, stop),
        "run": size(programs.run, programs.numbers),
    }


def lines(programs: Programs) -> int:
    """Lines of StableHLO of the run."""
    return jax.jit(programs.run).lower(programs.numbers).as_text().count("\n")


def attempts(subject: Subject) -> int:
    """Step attempts of the run of a scene, as `simulate` makes it."""
    result = sb.simulate(subject.scene(), solver=subject.solver, rtol=RTOL)
    return int(sum(result.record.stats[:3]))


def costs(programs: Programs) -> dict[str, float]:
    """Sizes of the lowered and the compiled run, and processor seconds; in a fresh process only."""
    accelerators("cpu")  # the options of XLA, tried once per process

    def clocked(call: Callable[[], Any]) -> tuple[Any, float]:
        start = time.process_time()
        return call(), time.process_time() - start

    # what is traced once is known to JAX afterwards: the second call only lowers, the third lowers and compiles
    _, trace = clocked(lambda: jax.make_jaxpr(programs.run)(programs.numbers))
    _, lower = clocked(lambda: jax.jit(programs.run).lower(programs.numbers))
    program, compile_ = clocked(lambda: compiled(programs.run, programs.numbers))
    record = program.call(programs.numbers)
    if code := int(record.code):
        raise RuntimeError(f"the run ends with {sb.results.FAILURES[code][0]}")
    warm = interleaved({"run": lambda: jax.block_until_ready(program.call(programs.numbers))}, 1.0)["run"]
    return {
        "instructions": sum(" = " in line for line in program.call.as_text().splitlines()),
        "one function": int(program.one_function),
        "trace, CPU s": trace,
        "lower, CPU s": lower,
        "compile, CPU s": compile_ - lower,
        "step attempts": int(record.count),
        "warm run, CPU µs": 1e6 * warm.cpu_median,
    }


def warm_prepared(subject: Subject, attempts: int) -> float:
    """Processor seconds of a prepared run, which gives a metric instead of the record of all attempts."""
    run = sb.prepare(subject.scene(), ["stopping_time"], solver=subject.solver, rtol=RTOL, max_steps=attempts)
    numbers = run.inputs(run.numbers, run.rtol)
    return interleaved({"run": lambda: np.asarray(run.program.call(numbers))}, 1.0)["run"].cpu_median


def configure() -> None:
    """What has to be set before JAX computes anything."""
    jax.config.update("jax_cpu_enable_async_dispatch", False)
    jax.config.update("jax_enable_compilation_cache", False)


def measured(name: str, count: bool) -> dict[str, float]:
    """All of one scene; without costs if `count` is set."""
    configure()
    programs = programs_of(name)
    # costs come first: to count would trace part of the run
    found = {} if count else costs(programs)
    if not count and name in SCENES:
        found["warm prepared run, CPU µs"] = 1e6 * warm_prepared(SCENES[name], int(1.25 * found["step attempts"]))
    return counts(programs) | {"StableHLO lines": lines(programs)} | found


def _cell(value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:,}" if isinstance(value, int) else f"{value:.3g}" if value < 100 else f"{value:,.0f}"


def table(found: dict[str, dict[str, float]]) -> str:
    """Scenes as columns."""
    lines = [["", *found]]
    for key in dict.fromkeys(key for row in found.values() for key in row):
        lines.append([key, *(_cell(row.get(key)) for row in found.values())])
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    return "\n".join(
        "  ".join([line[0].ljust(widths[0]), *(x.rjust(w) for x, w in zip(line[1:], widths[1:], strict=True))])
        for line in lines
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", action="append", choices=[ONE_STATE, *SCENES], help="default: all")
    parser.add_argument("--count", action="store_true", help="count equations and lines only")
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args()
    found = {}
    for name in options.scene or [ONE_STATE, *SCENES]:
        # a process of its own: what JAX has traced and compiled for one scene it need not do again for the next
        with concurrent.futures.ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
            found[name] = pool.submit(measured, name, options.count).result()
    if options.json:
        print(json.dumps({"jax": jax.__version__, "scenes": found}, indent=1))
    else:
        print(f"JAX {jax.__version__}\n{table(found)}\n")
        print("\n".join(f"{name}: {SCENES[name].title}" for name in found if name in SCENES))
    return 0


if __name__ == "__main__":
    sys.exit(main())
