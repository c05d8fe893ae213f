import gc
import importlib
import os
import pathlib

import jax
import psutil
import pytest
from browsers import browser_path
from compile_flags import set_flags
from jaxtyping import install_import_hook

#: memory mappings that a worker may have after a file of tests
MOST_MAPPINGS = 20_000
MAPS = pathlib.Path("/proc/self/maps")


def pytest_addoption(parser):
    parser.addoption(
        "--no-skips",
        action="store_true",
        help="a skipped test fails: CI installs what tests need",
    )
    parser.addoption(
        "--renew",
        action="store_true",
        help="write the texts in tests/files/golden anew",
    )


def pytest_configure(config):
    """Options of JAX; both workers, and later runs in this checkout, share what one of
    them has compiled."""
    cache = config.rootpath / ".pytest_cache"
    # users have JAX as it comes: SIMBRAKE_USER_OPTIONS=1 runs the tests so
    if os.environ.get("SIMBRAKE_USER_OPTIONS") != "1":
        set_flags(cache)
        jax.config.update("jax_numpy_dtype_promotion", "strict")
        jax.config.update("jax_cpu_enable_async_dispatch", False)
    kept = {
        "jax_compilation_cache_dir": str(cache / "programs"),
        "jax_persistent_cache_min_compile_time_secs": 0.0,
        "jax_persistent_cache_min_entry_size_bytes": -1,
    }
    # (programs of simbrake's own folder would outlive a mistake that a test plants)
    os.environ["SIMBRAKE_CACHE_DIR"] = ""
    for name, value in kept.items():
        jax.config.update(name, value)
        # for processes that tests start, and for commands that they call
        os.environ[name.upper()] = str(value)
    # shapes and types of every call are checked where asked, as they double the time to
    # trace
    if os.environ.get("SIMBRAKE_CHECK_TYPES") == "1":
        with install_import_hook("simbrake", "checked_types.checked"):
            for name in (
                "simbrake",
                "simbrake.cli._cli",
                "simbrake.pages._page",
                "simbrake.plot",
            ):
                module = importlib.import_module(name)
                for public in getattr(module, "__all__", ()):
                    # public names are imported when they are first used
                    home = getattr(module, public)
                    for name_of_home in getattr(home, "__all__", ()):
                        getattr(home, name_of_home)
    if os.environ.get("SIMBRAKE_USER_OPTIONS") != "1":
        # before the first program is compiled: see compile_flags
        importlib.import_module("simbrake._base._compiling")._CPU_OPTIONS[
            "xla_backend_optimization_level"
        ] = 0
    # tracing leaves millions of small objects, and hardly any rubbish in cycles
    gc.collect()
    gc.freeze()
    gc.set_threshold(200_000, 50, 100)


def pytest_ignore_collect(collection_path, config):
    """Where smoke tests alone are asked for, files without any are not imported: that
    takes longer than some of these tests."""
    if config.option.markexpr == "smoke" and collection_path.suffix == ".py":
        return "mark.smoke" not in collection_path.read_text("utf-8") or None
    return None


def pytest_terminal_summary(terminalreporter):
    """A missing browser is said loudly: pages are then tested by their data alone."""
    if browser_path() is None:
        words = (
            "NO BROWSER: reports, publications and apps were tested by their data "
            "alone, not in a browser."
        )
        terminalreporter.section("warning", sep="!", red=True, bold=True)
        terminalreporter.write_line(
            f"{words} Install chromium and playwright.", red=True, bold=True
        )


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    if report.skipped and item.config.getoption("no_skips"):
        report.outcome = "failed"
    return report


@pytest.fixture(scope="module", autouse=True)
def _forget_programs():
    """Files share programs, traced and compiled, until these take too much: all of them
    take gigabytes.

    Those of simbrake are in a store with a bound; what the tests compile themselves is
    held by JAX.
    """
    yield
    # (simbrake is first imported above, where types may be checked)
    from simbrake._base._store import trace_anew

    found = len(MAPS.read_bytes().splitlines()) if MAPS.exists() else 0
    if found > MOST_MAPPINGS / 2 or psutil.Process().memory_info().rss > 2e9:
        trace_anew()
    assert found <= MOST_MAPPINGS


@pytest.fixture(scope="session")
def scenarios():
    return pathlib.Path(__file__).parent.parent / "scenarios"


@pytest.fixture
def drawn(monkeypatch):
    """Figures that are saved while a test runs, by the names of their files: what a
    picture shows is read in them."""
    from matplotlib.figure import Figure

    found = {}
    save = Figure.savefig

    def saved(figure, file, *args, **kwargs):
        found[getattr(file, "name", str(file).rpartition(os.sep)[2])] = figure
        return save(figure, file, *args, **kwargs)

    monkeypatch.setattr(Figure, "savefig", saved)
    return found
