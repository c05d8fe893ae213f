"""Many structures in one process: each is simulated and printed, some with series, a
report and derivatives.

`python tests/many_structures.py VISITS DISTINCT` visits as many structures one after
the other, of which so many are distinct: one that returns finds its programs gone from
memory and reads them from the cache on disk. It prints memory mappings and resident
memory (MB) as it goes, and the peaks as JSON in the last line.
"""

import json
import pathlib
import sys
import tempfile

import jax
import psutil
from scenes import closed_form, stop_run, stop_scene

import simbrake as sb

MAPS = pathlib.Path("/proc/self/maps")


def stopping_time(omega, n):
    return stop_run(n, beta=270 / n, w0=omega, end=20.0).stopping_time


def visit(n, turn, folder):
    scene = stop_scene(n, beta=270 / n, end=20.0)
    result = sb.simulate(scene)
    truth = closed_form(n, beta=270 / n)["stop"]
    assert abs(float(result.stopping_time) / truth - 1) < 1e-9
    assert "stop" in str(result)
    if turn % 5 == 0:
        result.series([0.0, 0.1])
    if turn % 50 == 1:
        sb.prepare(scene, ["stopping_time"]).gradient()
    if turn % 100 == 11:
        jax.grad(stopping_time)(20.0, n)  # compiled by JAX, in its own caches
    if turn % 250 == 2:
        (folder / "report.html").write_text(sb.report(result), "utf-8")


def main(visits, distinct):
    # (the peak that the system keeps starts at that of the process which started this
    # one)
    most = 0
    peak = 0.0
    process = psutil.Process()
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(visits):
            visit(8 + turn % distinct, turn, pathlib.Path(folder))
            count = len(MAPS.read_bytes().splitlines()) if MAPS.exists() else 0
            memory = process.memory_info().rss / 1e6
            most = max(most, count)
            peak = max(peak, memory)
            if turn % 10 == 9:
                print(turn + 1, count, round(memory), flush=True)
    print(
        json.dumps(
            {
                "visits": visits,
                "distinct": distinct,
                "mappings": most,
                "megabytes": peak,
            }
        )
    )


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
