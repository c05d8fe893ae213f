"""XLA flags that let the tests compile faster, each used only if the installed JAX
accepts it.

XLA ends the process at an unknown flag, and flags come and go between releases: so each
is tried once per release in a process that may die. Without optimisation by LLVM
programs compile in three quarters of the time; those of simbrake itself take their
level as an option (`conftest.py`).
"""

import importlib.metadata
import json
import os
import pathlib
import subprocess
import sys

#: the older fusion emitters and no optimisation by LLVM: hardly any program of the
#: tests runs for long
FLAGS = ("--xla_cpu_use_fusion_emitters=false", "--xla_backend_optimization_level=0")
_PROBE = "import jax; jax.numpy.zeros(1).block_until_ready()"


def accepted(flag):
    """Whether a process with this flag in `XLA_FLAGS` survives its first
    computation."""
    environment = os.environ | {"XLA_FLAGS": flag, "JAX_PLATFORMS": "cpu"}
    probe = subprocess.run(
        [sys.executable, "-c", _PROBE],
        env=environment,
        capture_output=True,
        check=False,
    )
    return probe.returncode == 0


def accepted_flags(folder, flags=FLAGS):
    """The flags that this release of JAX accepts; asked once, the answers are kept in
    `folder`."""
    release = "_".join(
        f"{name}_{importlib.metadata.version(name)}" for name in ("jax", "jaxlib")
    )
    file = folder / f"xla_flags_{release}.json"
    try:
        known = json.loads(file.read_text("utf-8"))
    except (FileNotFoundError, json.JSONDecodeError):
        known = {}
    answers = {flag: known[flag] if flag in known else accepted(flag) for flag in flags}
    if answers != known:
        folder.mkdir(parents=True, exist_ok=True)
        part = file.with_suffix(f".{os.getpid()}")
        part.write_text(json.dumps(answers), "utf-8")
        part.replace(file)  # whole or not at all, whoever else runs tests here
    return [flag for flag in flags if answers[flag]]


def set_flags(folder):
    """Put the accepted flags into `XLA_FLAGS`, before JAX starts its backend; workers
    of pytest-xdist inherit them."""
    present = os.environ.get("XLA_FLAGS", "").split()
    if not set(present) & set(FLAGS):
        os.environ["XLA_FLAGS"] = " ".join(present + accepted_flags(folder))


if __name__ == "__main__":
    print(*accepted_flags(pathlib.Path(sys.argv[1])))
