"""An ensemble on a Dask cluster of processes whose client, workers or scheduler are
killed meanwhile."""

import contextlib
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from helpers import all_near
from scenes import stop_scene

import simbrake as sb

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]
SPEED = "initial.omega"
COUNT = 256
CHUNK = 8
VALUES = {SPEED: np.linspace(10.0, 24.0, COUNT)}
CLIENT = """
import sys
sys.path[:0] = sys.argv[3:]
import test_cluster
test_cluster.made(sys.argv[1], sys.argv[2], progress=False)
"""


def made(address, folder, **settings):
    return sb.ensemble(
        stop_scene(),
        VALUES,
        ["stopping_time"],
        client=address,
        directory=folder,
        chunk=CHUNK,
        **settings,
    )


@contextlib.contextmanager
def cluster():
    """The address of a scheduler, a function that starts a worker, and the processes,
    by which they are killed."""
    processes = []

    def started(kind, *arguments):
        module = [
            sys.executable,
            "-m",
            f"distributed.cli.dask_{kind}",
            *arguments,
            "--no-dashboard",
        ]
        processes.append(subprocess.Popen(module, stderr=subprocess.PIPE, text=True))
        return processes[-1].stderr

    try:
        lines = started("scheduler", "--host", "127.0.0.1", "--port", "0")
        address = next(line.split()[-1] for line in lines if "Scheduler at:" in line)

        def work():
            for line in started("worker", address, "--nthreads", "1", "--no-nanny"):
                if "Registered to" in line:
                    return processes[-1]
            raise RuntimeError("no worker was started")

        yield address, work, processes
    finally:
        for process in processes:
            process.kill()
            process.wait()
            process.stderr.close()


@pytest.fixture(scope="module")
def local():
    return sb.ensemble(
        stop_scene(), VALUES, ["stopping_time"], progress=False
    ).stopping_time.values


def chunks(folder):
    return len(list(folder.glob("chunk*")))


def test_resumed_after_a_killed_client(tmp_path, local):
    folder = tmp_path / "runs"
    with cluster() as (address, work, _):
        work()
        client = subprocess.Popen(
            [sys.executable, "-c", CLIENT, address, str(folder), *sys.path]
        )
        while chunks(folder) < 3:
            assert client.poll() is None
            time.sleep(0.02)
        client.send_signal(signal.SIGKILL)
        client.wait()
        kept = chunks(folder)
        counts = []
        data = made(address, folder, progress=lambda done, total: counts.append(done))
    assert kept < COUNT // CHUNK
    assert counts[0] >= 3 * CHUNK  # what is there is not made again
    all_near(data.stopping_time, local, 1e-12)


def test_goes_on_after_all_workers_died(tmp_path, local):
    killed = []
    with cluster() as (address, work, processes):
        work()
        work()

        def kill(done, total):
            if done >= 3 * CHUNK and not killed:
                killed.extend(processes[1:])
                for process in killed:
                    os.kill(process.pid, signal.SIGKILL)
                    process.wait()
                work()

        data = made(address, tmp_path / "runs", progress=kill)
    assert len(killed) == 2
    assert np.all(data.code == 0)
    all_near(data.stopping_time, local, 1e-12)
