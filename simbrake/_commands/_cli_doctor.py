"""The command `simbrake doctor`."""

import json
import os
import platform
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from ._cli_options import Json, prepare_jax

CANNOT = "simbrake cannot compute here."
PACKAGES = ("simbrake", "jax", "jaxlib", "diffrax", "equinox", "numpy", "scipy")


def versions() -> dict[str, str]:
    """Python, simbrake and the packages that its numbers depend on."""
    return {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}


def doctor(*, time_: Annotated[bool, Parameter(name="--time", negative="")] = False, json_: Json = False) -> int:
    """Report what this installation has: versions, devices, 64 bits, kept programs, accelerators and their worth.

    The exit code is 1 if simbrake cannot compute here.

    Parameters
    ----------
    time_
        Measure a standard stop as well, in seconds of processor time: compiling, a warm run, its error.
    json_
        Print {ok, notes, versions, tested_jax, x64, devices, cache, xla_flags, accelerators, timing}, alone on stdout.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            prepare_jax()
            found = examined()
        except (ImportError, RuntimeError, AssertionError) as error:  # JAX finds no device of JAX_PLATFORMS, say
            why = f"{type(error).__name__}: {error}".strip().splitlines()[0]
            platforms = os.environ.get("JAX_PLATFORMS")
            hint = f" (JAX_PLATFORMS is {platforms}: try without it)" if platforms else ""
            report = {"ok": False, "notes": [why + hint], "versions": versions()}
            print(json.dumps(report, indent=1) if json_ else "\n".join([CANNOT, f"  {why}{hint}"]))
            return 1
    notes = [str(one.message) for one in caught if issubclass(one.category, UserWarning)]
    missing = [row["name"] for row in found["accelerators"] if not row["in_force"]]
    if missing:
        notes.append(f"XLA refuses {', '.join(missing)}: answers are the same, only slower (see accelerators)")
    if not found["cache"]["folder"]:
        notes.append("compiled programs are not kept: every command compiles anew; set JAX_COMPILATION_CACHE_DIR")
    report: dict[str, Any] = {"ok": found["x64"], "notes": notes} | found
    if time_ and report["ok"]:
        report["timing"] = timing()
    print(json.dumps(report, indent=1, allow_nan=False) if json_ else text(report))
    return 0 if report["ok"] else 1


def examined() -> dict[str, Any]:
    """Everything but the time of a run."""
    import jax
    import jax.numpy as jnp

    from .._base._compiling import FIRST_UNTESTED_JAX, OLDEST_JAX, WORTH, accelerators, run_device

    here = run_device()
    refused = accelerators(here.platform).refused
    rows = [{"name": name, "in_force": name not in refused, "worth": worth} for name, worth in WORTH.items()]
    oldest, untested = (".".join(map(str, numbers)) for numbers in (OLDEST_JAX, FIRST_UNTESTED_JAX))
    return {
        "versions": versions(),
        "tested_jax": f"{oldest} to below {untested}",
        "x64": jnp.ones(()).dtype == jnp.float64,
        "devices": {
            "all": [str(device) for device in jax.devices()],
            "single_runs": str(here),
            "ensembles": [str(device) for device in jax.devices()],
        },
        "cache": _cache(),
        "xla_flags": os.environ.get("XLA_FLAGS", ""),
        "accelerators": rows if here.platform == "cpu" else [],
    }


def _cache() -> dict[str, Any]:
    import jax

    folder = jax.config.jax_compilation_cache_dir or ""  # pyright: ignore
    sizes = [file.stat().st_size for file in Path(folder).rglob("*") if file.is_file()] if folder else []
    return {"folder": folder, "programs": len(sizes), "bytes": sum(sizes)}


def timing() -> dict[str, float]:
    """Processor time of a stop of 20 linings on an elastic band from the onset of slip, and its relative error.

        ω(t) falls in full slip by J ω̇ = −R (Π − 1) T_0,   Π = ((1 + f z)/(1 − f z))ⁿ

    The error is that of the deceleration between the last two events, full slip and stop.
    """
    import math
    import time

    import numpy as np

    import simbrake as sb

    R, J, T_0, f, n, beta = 0.725, 800.0, 8e3, 0.35, 20, math.radians(13.5)
    brake = sb.Brake(sb.Pulley(R, J), sb.Band(R, 2e5), sb.Lining(sb.ConstantFriction(f), np.full(n, beta)))
    scene = sb.Scene(brake, sb.Duty(sb.Constant(T_0), sb.TorqueLoad()), sb.Initial(20.0), 1.0)
    begin = time.process_time()
    run = sb.prepare(scene, ("full_slip_time", "stopping_time"), max_steps=128)
    compiling, count = time.process_time() - begin, 200
    answer = run()
    begin = time.process_time()
    for _ in range(count):
        run()
    warm = (time.process_time() - begin) / count
    slip, stop = answer.metrics["full_slip_time"], answer.metrics["stopping_time"]
    speed = float(run.result().series([slip]).omega[0])
    z = f * math.tan(beta / 2)
    deceleration = R * T_0 * (((1 + z) / (1 - z)) ** n - 1) / J
    return {"compiling": compiling, "warm_run": warm, "error": abs(speed / deceleration / (stop - slip) - 1)}


def text(report: dict[str, Any]) -> str:
    """The report for reading, verdict first."""
    found, devices, cache = report["versions"], report["devices"], report["cache"]
    lines = ["simbrake can compute here." if report["ok"] else CANNOT]
    lines += [f"  note: {note}" for note in report["notes"]]
    lines += ["", "versions      " + ", ".join(f"{name} {number}" for name, number in found.items())]
    lines += [f"              tested with JAX {report['tested_jax']}"]
    lines += [f"precision     {'64' if report['x64'] else '32'} bits"]
    lines += [f"devices       {', '.join(devices['all'])}"]
    lines += [f"              single runs on {devices['single_runs']}, ensembles on {', '.join(devices['ensembles'])}"]
    size = f"{cache['programs']} files, {cache['bytes'] / 1e6:.1f} MB"
    lines += [f"programs      {cache['folder']} ({size})" if cache["folder"] else "programs      not kept"]
    lines += [f"XLA_FLAGS     {report['xla_flags'] or 'not set'} (simbrake never sets it)"]
    for i, row in enumerate(report["accelerators"]):
        state = "in force" if row["in_force"] else "refused"
        lines += [f"{'accelerators' if i == 0 else '':<14}{row['name']:<38}{state:<10}{row['worth']}"]
    if "timing" in report:
        t = report["timing"]
        took = f"compiling {t['compiling']:.2g} s, a warm run {t['warm_run'] * 1e6:.3g} µs of processor time"
        lines += [f"{'timing':<14}standard stop: {took}, error {t['error']:.1e}"]
    return "\n".join(lines)
