"""Commands about the installation and the program: doctor, validate, reproduce."""

import importlib
import os
import platform
import sys
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

import simbrake as sb

from .._base._faults import input_error
from .._base._progress import Progress
from ..files.shipped_scenes import scene_file
from . import _options as cli

CANNOT = "simbrake cannot compute here."
PACKAGES = ("simbrake", "jax", "jaxlib", "diffrax", "equinox", "numpy", "scipy")


def versions() -> dict[str, str]:
    """Python, simbrake and the packages that its numbers depend on."""
    return {"python": platform.python_version()} | {
        name: version(name) for name in PACKAGES
    }


def doctor(*, time_: cli.Flag = False, json_: cli.Flag = False) -> int:
    """Report the installation: versions, devices, precision, compiled programs.

    Parameters
    ----------
    time_
        Measure a standard stop as well: processor time to compile and of a warm run,
        and its error.
    json_
        Print {ok, notes, versions, tested_jax, x64, devices, cache, memory, xla_flags,
        timing}, alone on stdout.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            cli.prepare_jax()
            facts = _examined()
        # for example, JAX finds no device of JAX_PLATFORMS
        except (ImportError, RuntimeError, AssertionError, sb.InputError) as error:
            note = f"{type(error).__name__}: {error}".strip().splitlines()[0]
            if isinstance(error, sb.InputError):
                note = str(error.faults[0])
            if platforms := os.environ.get("JAX_PLATFORMS"):
                note += f" (JAX_PLATFORMS is {platforms}: try without it)"
            cli.tell(
                f"{CANNOT}\n  {note}",
                json_,
                {"ok": False, "notes": [note], "versions": versions()},
            )
            return 1
    notes = [
        str(warning.message)
        for warning in caught
        if issubclass(warning.category, UserWarning)
    ]
    if not facts["cache"]["folder"]:
        notes.append(
            "compiled programs are not cached: every command compiles again; set SIMBRAKE_CACHE_DIR"
        )
    elif facts["cache"]["jax"]:
        notes.append(
            "JAX's own cache is on: simbrake writes no programs to its cache, and "
            "traces anew in every process"
        )
    report = {"ok": facts["x64"], "notes": notes} | facts
    if time_ and report["ok"]:
        report["timing"] = _timing()
    cli.tell(_text(report), json_, report)
    return cli.exit_code(report["ok"])


def _examined() -> dict[str, Any]:
    """The report without the timing of a run."""
    import jax
    import jax.numpy as jnp

    from .._base import _store
    from .._base._compiling import FIRST_UNTESTED_JAX, OLDEST_JAX, of_jax, run_device

    oldest, untested = (
        ".".join(map(str, numbers)) for numbers in (OLDEST_JAX, FIRST_UNTESTED_JAX)
    )
    kept = _cache_about()
    devices = [str(device) for device in jax.devices()]
    return {
        "versions": versions(),
        "tested_jax": f"{oldest} to below {untested}",
        "x64": jnp.ones(()).dtype == jnp.float64,
        "devices": {
            "all": devices,
            "single_runs": str(run_device()),
            "ensembles": devices,
        },
        "cache": {name: kept[name] for name in ("folder", "programs", "bytes")}
        | {"jax": of_jax()},
        "memory": {"megabytes": _store.memory_bound()},
        "xla_flags": os.environ.get("XLA_FLAGS", ""),
    }


def cache(*, clear: cli.Flag = False, json_: cli.Flag = False) -> int:
    """Show or clear the cache of compiled programs on disk, which later runs of scenes
    of the same structure use.

    The environment variable SIMBRAKE_CACHE_DIR names its folder (empty: no cache); by
    default it is simbrake/programs in the user's cache folder. It takes at most
    SIMBRAKE_CACHE_SIZE MB (512); the files unused for longest go first.

    Parameters
    ----------
    clear
        Remove all cached programs.
    json_
        Print {folder, programs, bytes, limit_bytes, removed, kinds}, alone on stdout.
    """
    from .._base import _store
    from .._base._table import Column, Table

    folder = _store.folder()
    gone = folder.entries() if folder is not None and clear else []
    for entry in gone:
        folder.remove(entry.name)  # pyright: ignore
    about: dict[str, Any] = _cache_about() | {"removed": len(gone)}
    if not about["folder"]:
        text = "compiled programs are not cached"
    elif clear:
        text = f"{len(gone)} files removed from {about['folder']}"
    else:
        limit = about["limit_bytes"] / 1e6
        verdict = (
            f"{about['programs']} files, {about['bytes'] / 1e6:.1f} of at most "
            f"{limit:g} MB, in {about['folder']}"
        )
        rows = [
            (kind, row["files"], row["bytes"] / 1e6)
            for kind, row in sorted(about["kinds"].items())
        ]
        table = Table(
            ["program or answer", Column("files"), Column("MB", show=".2f")], rows
        )
        text = f"{verdict}\n\n{table}" if rows else verdict
    cli.tell(text, json_, about)
    return 0


def _cache_about() -> dict[str, Any]:
    """Folder of the cached programs (empty: no cache), their number and sizes, in total
    and by kind."""
    from .._base import _store

    folder = _store.folder()
    entries = [] if folder is None else folder.entries()
    kinds: dict[str, dict[str, int]] = {}
    for entry in entries:
        kind = kinds.setdefault(
            entry.name.rpartition("-")[0].strip("_"), {"files": 0, "bytes": 0}
        )
        kind["files"] += 1
        kind["bytes"] += entry.size
    return {
        "folder": "" if folder is None else str(folder.path),
        "programs": len(entries),
        "bytes": sum(entry.size for entry in entries),
        "limit_bytes": round(_store.size_bound() * 1e6),
        "kinds": kinds,
    }


def _timing() -> dict[str, float]:
    """Processor time of a stop of 20 linings on an elastic band, and the relative error
    of its stopping time."""
    import time

    from ..checks.closed_forms import elastic_scene, elastic_stop

    begin = time.process_time()
    run = sb.prepare(elastic_scene(), ("stopping_time",), max_steps=128)
    compiling = time.process_time() - begin
    count = 200
    stop = run().metrics["stopping_time"]
    begin = time.process_time()
    for _ in range(count):
        run()
    warm = (time.process_time() - begin) / count
    return {
        "compiling": compiling,
        "warm_run": warm,
        "error": abs(stop / elastic_stop()[1] - 1),
    }


def _text(report: dict[str, Any]) -> str:
    """The report as text, verdict first."""
    devices = report["devices"]
    cache = report["cache"]
    size = f"{cache['programs']} files, {cache['bytes'] / 1e6:.1f} MB"
    memory = report["memory"]
    versions = ", ".join(f"{name} {text}" for name, text in report["versions"].items())
    ensembles = ", ".join(devices["ensembles"])
    place = f"{cache['folder']} ({size})" if cache["folder"] else "not cached"
    lines = [
        f"versions      {versions}",
        f"              tested with JAX {report['tested_jax']}",
        f"precision     {'64' if report['x64'] else '32'} bits",
        f"devices       {', '.join(devices['all'])}",
        f"              single runs on {devices['single_runs']}, ensembles on {ensembles}",
        f"programs      {place}",
        f"              in a process at most some {memory['megabytes']:g} MB",
        f"XLA_FLAGS     {report['xla_flags'] or 'not set'} (simbrake never sets it)",
    ]
    if "timing" in report:
        t = report["timing"]
        took = (
            f"compiling {t['compiling']:.2g} s, a warm run "
            f"{t['warm_run'] * 1e6:.3g} µs of processor time"
        )
        lines.append(f"timing        standard stop: {took}, error {t['error']:.1e}")
    verdict = "simbrake can compute here." if report["ok"] else CANNOT
    notes = [f"  note: {note}" for note in report["notes"]]
    return "\n".join([verdict, *notes, "", *lines])


def validate(
    *,
    only: str | None = None,
    list_: cli.Flag = False,
    cross_check: Annotated[Path | None, Parameter(converter=cli.named_file)] = None,
    method: str | None = None,
    rtol: float = 1e-10,
    allowed: float | None = None,
    max_evaluations: int = 400_000,
    set_: cli.Set = None,
    json_: cli.Flag = False,
) -> int:
    """Compare simbrake with twelve closed forms; or a scene with SciPy.

    Parameters
    ----------
    only
        Run only the cases whose name contains this text, or matches it as a pattern
        with *.
    list_
        Print the cases without running them.
    cross_check
        Scene to run with SciPy as well, instead of the cases: changes of mode, event
        times, state and energies at the end, side by side.
    method
        Method of scipy.integrate.solve_ivp for --cross-check: DOP853, RK45, RK23,
        Radau, BDF, LSODA.
    rtol
        Relative tolerance of both runs of --cross-check.
    allowed
        Relative difference allowed by --cross-check; by default 100 times rtol.
    max_evaluations
        Maximum number of evaluations of the right-hand side by SciPy in --cross-check.
    json_
        Print a list of {case, source, value, truth, error, tolerance, verdict}, alone
        on stdout.
    """
    if cross_check is not None:
        scene_file(cross_check)
    cli.prepare_jax()
    if list_ and cross_check is None:
        from .._base._table import Column, Table
        from ..checks.closed_forms import chosen

        columns = [
            "case",
            Column("tolerance", show=".0e"),
            "source",
            Column("truth", hidden=True),
        ]
        table = Table(
            columns, [(c.name, c.tolerance, c.source, c.truth) for c in chosen(only)]
        )
        cli.tell(table, json_, table.as_list())
        return 0
    if cross_check is None:
        report = sb.validate(only, progress=None)
    else:
        scene = cli.opened(cross_check, set_, rtol, max_evaluations=max_evaluations)
        report = sb.cross_check(
            scene,  # pyright: ignore
            method=method,
            rtol=rtol,
            tolerance=allowed,
            max_evaluations=max_evaluations,
            progress=None,
        )
    cli.tell(report, json_, report.as_list(), report.ok)
    return cli.exit_code(report.ok)


def reproduce(*, out: cli.Out = None, json_: cli.Flag = False) -> int:
    """Recompute the published tables cell by cell, in a checkout of the repository:
    `python papers/reproduce.py`.

    --out draws the papers' figures and tables that a formula gives, with the printed numbers as points.

    Parameters
    ----------
    json_
        Print a list of {table, row, column, printed, computed, verdict, kind}, alone on
        stdout.
    """
    script = Path(sb.__file__).parents[1] / "papers" / "reproduce.py"
    if not script.exists():
        hint = (
            "python papers/reproduce.py in a checkout of the repository recomputes them"
        )
        what = "the papers' tables are not part of the package"
        raise input_error("reproduce", what, hint)
    cli.prepare_jax()
    print("note: this command becomes: python papers/reproduce.py", file=sys.stderr)
    options = [
        *(["--json"] if json_ else []),
        *([] if out is None else ["--out", str(out)]),
    ]
    sys.path.insert(0, str(script.parent))
    try:
        return importlib.import_module("reproduce").main(options)
    finally:
        sys.path.remove(str(script.parent))


def test(
    file: Annotated[Path, Parameter(name="FILE")],
    /,
    *,
    json_: cli.Flag = False,  # noqa: PT028
) -> int:
    """Run acceptance tests of a brake that a file lists, and print one table of
    verdicts.

    Parameters
    ----------
    file
        File of tests (TOML): a scene, changes, and what must hold.
    json_
        Print {passed, failed, tests, note}, alone on stdout.
    """
    cli.prepare_jax()
    with Progress("test", "reading…") as progress:
        tests = sb.checks.read_tests(file)
        counted = lambda done, of: progress.now(f"test {done + 1} of {of}")
        found = sb.checks.run_tests(tests, progress=counted)
    cli.tell(found, json_, ok=found.passed)
    return 0 if found.passed else 3


#: commands and their exit codes
COMMANDS = {
    doctor: "0 simbrake can compute here; 1 it cannot.",
    cache: "0 success.",
    test: "0 every test passed; 2 the input is wrong; 3 a test failed.",
    validate: "0 every number is within its tolerance; 1 one is not; 2 the input is wrong.",
    reproduce: "0 no cell disagrees; 1 one does; 2 the input is wrong.",
}
