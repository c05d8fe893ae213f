"""Speed against error of one stop without heat: simbrake beside SciPy, both errors against the closed form.

`python benchmarks/engine.py` prints a table, with `--fast-loops` after calling `simbrake.fast_loops()`. Medians of
repeated warm runs of a jitted function; quote the ratios, absolute times depend on the machine.
"""

import argparse
import math
import os
import platform
import time


def closed_form(n=20, f=0.35, beta=0.235619449019234, R=0.725, J=800.0, C=2e5, T_0=8e3, w_0=20.0):
    """Onset, full slip and stop (Z-15…Z-18)."""
    z = math.tan(beta / 2)
    Pi = ((1 + f * z) / (1 - f * z)) ** n
    chi = math.sqrt(C * R**2 / J)
    t_0 = T_0 / (C * R * w_0)
    t_1 = t_0 + math.asin(chi * T_0 * (Pi - 1) / (C * R * w_0)) / chi
    return t_0, t_1, t_1 + w_0 * math.cos(chi * (t_1 - t_0)) * J / (R * T_0 * (Pi - 1))


def median_time(call, count):
    call()
    times = []
    for _ in range(9):
        start = time.perf_counter()
        for _ in range(count):
            call()
        times.append((time.perf_counter() - start) / count)
    return sorted(times)[len(times) // 2]


def scipy_stop(tolerance):
    """The same stop, mode by mode, right-hand sides in plain floats: careful use of solve_ivp."""
    from scipy.integrate import solve_ivp

    R, J, C, T_0, w_0 = 0.725, 800.0, 2e5, 8e3, 20.0
    z = math.tan(math.radians(13.5) / 2)
    Pi = ((1 + 0.35 * z) / (1 - 0.35 * z)) ** 20

    def phase(fun, guard, t, y):
        guard.terminal, guard.direction = True, -1
        out = solve_ivp(fun, (t, 5.0), y, method="DOP853", rtol=tolerance, atol=tolerance * 1e-2, events=guard)
        return out.t[-1], out.y[:, -1]

    t_0, y = phase(lambda t, y: (0.0, R * y[0]), lambda t, y: T_0 - C * y[1], 0.0, (w_0, 0.0))
    t_1, y = phase(lambda t, y: (-R * (C * y[1] - T_0) / J, R * y[0]), lambda t, y: T_0 * Pi - C * y[1], t_0, y)
    stop, _ = phase(lambda t, y: (-R * T_0 * (Pi - 1) / J,), lambda t, y: y[0], t_1, y[:1])
    return t_0, t_1, stop


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fast-loops", action="store_true")
    fast = parser.parse_args().fast_loops
    import diffrax
    import jax
    import jax.numpy as jnp
    import numpy as np

    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_cpu_enable_async_dispatch", False)
    import simbrake as sb

    if fast:
        sb.fast_loops()
    linings = sb.uniform_linings(20, math.radians(270), sb.ConstantFriction(0.35))
    brake = sb.Brake(sb.Pulley(0.725, 800.0), sb.Band(0.725, 2e5), linings)
    scene = sb.Scene(brake, sb.Duty(sb.Constant(8e3), sb.TorqueLoad()), sb.Initial(20.0), 5.0)
    scene = jax.tree.map(jnp.asarray, scene)
    truth = np.asarray(closed_form())

    print(f"{platform.machine()}, {os.cpu_count()} cores, jax {jax.__version__}, diffrax {diffrax.__version__}")
    print(f"{'':22}{'rtol':>8}{'error':>10}{'run µs':>9}{'compile s':>11}{'gradient/run':>14}{'SciPy/run':>11}")
    for tolerance in (1e-6, 1e-10):
        seconds = median_time(lambda tolerance=tolerance: scipy_stop(tolerance), 5)
        error = np.max(np.abs(np.asarray(scipy_stop(tolerance)) / truth - 1))
        print(f"{'SciPy DOP853':22}{tolerance:8.0e}{error:10.1e}{1e6 * seconds:9.0f}")
        for solver in (diffrax.Tsit5(), diffrax.Dopri8()):

            def events(scene, solver=solver, tolerance=tolerance):
                r = sb.simulate(scene, solver=solver, rtol=tolerance, max_steps=128)
                return jnp.stack([r.slip_onset_time, r.full_slip_time, r.stopping_time])

            run = jax.jit(events)
            start = time.perf_counter()
            jax.block_until_ready(run(scene))
            compiled = time.perf_counter() - start
            gradient = jax.jit(jax.grad(lambda scene, events=events: events(scene)[2]))
            error = np.max(np.abs(np.asarray(run(scene)) / truth - 1))
            one = median_time(lambda run=run: jax.block_until_ready(run(scene)), 50)
            ratio = median_time(lambda g=gradient: jax.block_until_ready(g(scene)), 20) / one
            name = f"simbrake {type(solver).__name__}"
            row = f"{name:22}{tolerance:8.0e}{error:10.1e}{1e6 * one:9.0f}{compiled:11.1f}"
            print(f"{row}{ratio:14.1f}{seconds / one:11.1f}")


if __name__ == "__main__":
    main()
