"""Throughput of 10,000 different stops: simbrake's ensemble beside SciPy's DOP853 with events, in the same run.

`python benchmarks/ensemble.py` prints runs per second and errors against the closed form, with and without
`simbrake.fast_loops()` (each in a process of its own), and what sorting by expected cost gives. `--quick`: 1,000 stops.
Quote the ratios, absolute figures depend on the machine.
"""

import argparse
import json
import math
import os
import platform
import subprocess
import sys
import time

import numpy as np

PATHS = ("initial.omega", "brake.linings.friction.coefficient", "duty.slack_tension.level")
R, J, C, N, BETA, END = 0.725, 800.0, 2e5, 20, math.radians(13.5), 10.0


def drawn(count):
    """Speeds, coefficients of friction and slack tensions of different stops."""
    rng = np.random.default_rng(1)
    return rng.uniform(10, 25, count), rng.uniform(0.25, 0.4, count), rng.uniform(6e3, 1e4, count)


def closed_form(w_0, f, T_0):
    """Onset, full slip and stop (Z-15…Z-18)."""
    z = math.tan(BETA / 2)
    Pi = ((1 + f * z) / (1 - f * z)) ** N
    chi = math.sqrt(C * R**2 / J)
    t_0 = T_0 / (C * R * w_0)
    t_1 = t_0 + np.arcsin(chi * T_0 * (Pi - 1) / (C * R * w_0)) / chi
    return np.stack([t_0, t_1, t_1 + w_0 * np.cos(chi * (t_1 - t_0)) * J / (R * T_0 * (Pi - 1))])


def scipy_stop(w_0, f, T_0, tolerance):
    """The same stop, mode by mode, right-hand sides in plain floats: careful use of solve_ivp."""
    from scipy.integrate import solve_ivp

    z = math.tan(BETA / 2)
    Pi = ((1 + f * z) / (1 - f * z)) ** N

    def phase(fun, guard, t, y):
        guard.terminal, guard.direction = True, -1
        out = solve_ivp(fun, (t, END), y, method="DOP853", rtol=tolerance, atol=tolerance * 1e-2, events=guard)
        return out.t[-1], out.y[:, -1]

    t_0, y = phase(lambda t, y: (0.0, R * y[0]), lambda t, y: T_0 - C * y[1], 0.0, (w_0, 0.0))
    t_1, y = phase(lambda t, y: (-R * (C * y[1] - T_0) / J, R * y[0]), lambda t, y: T_0 * Pi - C * y[1], t_0, y)
    stop, _ = phase(lambda t, y: (-R * T_0 * (Pi - 1) / J,), lambda t, y: y[0], t_1, y[:1])
    return t_0, t_1, stop


def scene(load=None):
    import simbrake as sb

    linings = sb.Lining(sb.ConstantFriction(0.35), np.full(N, BETA))
    brake = sb.Brake(sb.Pulley(R, J), sb.Band(R, C), linings)
    duty = sb.Duty(sb.Constant(8e3), sb.TorqueLoad() if load is None else sb.TorqueLoad(load))
    return sb.Scene(brake, duty, sb.Initial(20.0), END)


def best_of(call, times=5):
    """Answer, shortest wall time and CPU time of a warm call, and the wall time of the first.

    What other work on the machine adds is not ours: shortest times, and CPU time, which hardly knows of it.
    """
    first = time.perf_counter()
    out = call()
    first = time.perf_counter() - first
    walls, cores = [], []
    for _ in range(times):
        wall, core = time.perf_counter(), time.process_time()
        out = call()
        walls.append(time.perf_counter() - wall)
        cores.append(time.process_time() - core)
    return out, min(walls), min(cores), first


def wavy(t, parameters):
    import jax.numpy as jnp

    return 2e3 * jnp.sin(30.0 * t)


def measure(count, fast):
    """Everything of simbrake in one process, as a dictionary."""
    import jax

    jax.config.update("jax_enable_x64", True)
    import simbrake as sb
    from simbrake import _ensemble

    if fast:
        sb.fast_loops()
    rows, found = drawn(count), {}
    truth, names = closed_form(*rows), ("slip_onset_time", "full_slip_time", "stopping_time")
    values = dict(zip(PATHS, rows, strict=True))
    for rtol in (1e-6, 1e-10):
        out = best_of(lambda rtol=rtol: sb.ensemble(scene(), values, names, rtol=rtol, progress=False))
        data, wall, core, first = out
        error = max(float(np.max(np.abs(data[name].values / t - 1))) for name, t in zip(names, truth, strict=True))
        found[f"{rtol:.0e}"] = {"rate": count / wall, "core": count / core, "error": error, "first": first}
    # runs of very different length under a load that swings: here the order matters
    long = {"end_time": 10 ** np.random.default_rng(2).uniform(-0.5, 1.5, count), "initial.omega": rows[0]}
    load = scene(sb.FunctionProfile(wavy))
    sorts, cores = _ensemble.expected_cost, {}
    for order in (sorts, lambda columns, known, steps: np.zeros(len(columns))):
        _ensemble.expected_cost = order
        cores[order is sorts] = (
            best_of(lambda: sb.ensemble(scene(), values, names, progress=False))[2],
            best_of(lambda: sb.ensemble(load, long, names, progress=False), 2)[2],
        )
    (stops, unequal), (plain_stops, plain_unequal) = cores[True], cores[False]
    return found | {"order_of_stops": plain_stops / stops, "order": plain_unequal / unequal}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--measure", choices=["plain", "fast"], help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    count = 1_000 if arguments.quick else 10_000
    if arguments.measure:
        print(json.dumps(measure(count, arguments.measure == "fast")))
        return
    rows = np.stack(drawn(count), axis=1)[: 60 if arguments.quick else 300]
    print(f"{platform.machine()}, {os.cpu_count()} cores; {count} stops, SciPy {len(rows)} of them, one core")
    head = f"{'':26}{'rtol':>8}{'error':>10}{'first call s':>14}{'runs/s':>10}{'runs per core s':>17}"
    print(f"{head}{'ratio':>8}{'ratio per core':>16}")
    rates = {}
    scipy_stop(*(float(x) for x in rows[0]), 1e-6)  # its imports
    for rtol in (1e-6, 1e-10):
        wall, core = time.perf_counter(), time.process_time()
        stops = np.asarray([scipy_stop(*(float(x) for x in row), rtol) for row in rows])
        wall, core = len(rows) / (time.perf_counter() - wall), len(rows) / (time.process_time() - core)
        rates[f"{rtol:.0e}"] = wall, core
        error = np.max(np.abs(stops / closed_form(*rows.T).T - 1))
        print(f"{'SciPy DOP853':26}{rtol:8.0e}{error:10.1e}{'':14}{wall:10.0f}{core:17.0f}")
    for way in ("plain", "fast"):
        options = [*(["--quick"] if arguments.quick else []), "--measure", way]
        done = subprocess.run([sys.executable, __file__, *options], capture_output=True, text=True, check=True)
        found = json.loads(done.stdout)
        name = "simbrake" + (", fast_loops()" if way == "fast" else "")
        for rtol, (wall, core) in rates.items():
            r = found[rtol]
            row = f"{name:26}{rtol:>8}{r['error']:10.1e}{r['first']:14.1f}{r['rate']:10.0f}{r['core']:17.0f}"
            print(f"{row}{r['rate'] / wall:8.0f}{r['core'] / core:16.0f}")
        stops, unequal = found["order_of_stops"], found["order"]
        print(
            f"{'':26}unsorted, the CPU time is {stops:.2f} times as long; of runs of unequal length {unequal:.2f} times"
        )


if __name__ == "__main__":
    main()
