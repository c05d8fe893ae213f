"""What the commands have in common: options, 64 bits, the scene they work on."""

import gc
import os
import sys
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

Many = Annotated[list[str] | None, Parameter(negative="", consume_multiple=False)]
#: options that several commands have, and what their help says; a command's docstring says the rest
Scenario = Annotated[Path, Parameter(help="Scene file: TOML, or Python with a function scene().")]
_SET = 'PATH=VALUE: override a number of the scene (SI, or with its unit), as "duty.load.mass=30 t"; may be repeated.'
Set = Annotated[list[str] | None, Parameter(name="--set", negative="", consume_multiple=False, help=_SET)]
Rtol = Annotated[float, Parameter(help="Relative tolerance of the integration.")]
Json = Annotated[bool, Parameter(name="--json", negative="")]
_LIMIT = (
    'METRIC=VALUE: greatest permissible value (SI, or with its unit), as "max_tension=120 kN" or '
    '"peak_rim_temperature=450 degC"; of a metric or max_pressure; may be repeated.'
)
Limits = Annotated[list[str] | None, Parameter(name="--limit", negative="", consume_multiple=False, help=_LIMIT)]
_FAIL = "Exit with code 3 if a limit is exceeded: one of --limit, or the permissible temperature of the scene."
FailOnLimit = Annotated[bool, Parameter(name="--fail-on-limit", negative="", help=_FAIL)]
#: exit code of a command that was asked to fail on a limit
LIMIT_EXCEEDED = 3


def _cache() -> str:
    """Where compiled programs are kept; nowhere (empty) if there is no place that can be written."""
    cache = os.environ.get("JAX_COMPILATION_CACHE_DIR")
    if cache is None:
        base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
        cache = os.path.join(base, "simbrake", "compiled")
        if not os.path.isabs(cache):  # who has no home gets "~" for it
            return ""
    try:
        if cache:
            os.makedirs(cache, exist_ok=True)
    except OSError:
        return ""
    return cache if os.access(cache, os.W_OK) else ""


def prepare_jax() -> None:
    """64 bits, and compiled programs kept between runs (`JAX_COMPILATION_CACHE_DIR` moves them, empty: none)."""
    cache = _cache()
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")  # a hit of the cache is no news for users
    import jax

    jax.config.update("jax_enable_x64", True)
    if cache:
        jax.config.update("jax_compilation_cache_dir", cache)
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
    # tracing makes millions of small objects and hardly any rubbish in cycles: the collector need not look so often
    gc.freeze()
    gc.set_threshold(100_000, 50, 100)


def opened(scenario: Path, set_: list[str] | None, out: Path | None, **limits: tuple[Any, bool, str]) -> Any:
    """The scene of a command, its numbers overridden; faults of the options first: name, value, admissible, hint."""
    from .._base._faults import Fault, InputError
    from .._run._edit import parse_assignments, with_values
    from ..files._scene_file import open_scene

    wrong = [
        Fault(f"--{name.replace('_', '-')}", f"{value} is out of range", hint)
        for name, (value, admissible, hint) in limits.items()
        if not admissible
    ]
    if out is not None and out.exists() and not out.is_dir():
        wrong.append(Fault("--out", f"{out} is a file", "give a folder"))
    if wrong:
        raise InputError(wrong)
    return with_values(open_scene(scenario), parse_assignments(set_ or []))


def limits_asked(scene: Any, texts: list[str] | None, fail: bool) -> tuple[dict[str, float], list[Any]]:
    """Limits of `--limit` in SI, and the faults; `--fail-on-limit` needs something that can be exceeded."""
    from .._base._faults import Fault
    from .._run._measure import has_limit, parse_limits

    limits, faults = parse_limits(scene, texts or [])
    if fail and not texts and not has_limit(scene, {}):
        hint = "give --limit, or the scene a permissible temperature (heat.permissible)"
        faults.append(Fault("--fail-on-limit", "there is no limit that could be exceeded", hint))
    return limits, faults


def exit_code(ok: bool, checks: list[Any], fail: bool) -> int:
    """0 the run reached its end, 1 it failed, 3 it exceeded a limit and was asked to say so."""
    from .._run._measure import LimitVerdict

    exceeded = any(check.verdict == LimitVerdict.EXCEEDED for check in checks)
    return 1 if not ok else LIMIT_EXCEEDED if fail and exceeded else 0


def tolerance(rtol: float) -> tuple[float, bool, str]:
    return rtol, 1e-15 < rtol < 0.1, "0 < rtol < 0.1"


def limit(count: int | None) -> tuple[int | None, bool, str]:
    return count, count is None or count > 0, "at least 1"


def nobody_reads() -> None:
    """What is printed from now on goes nowhere: whoever read it has gone."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def say(text: object) -> None:
    """Prints at once. A reader that has gone, as `head -1` does, does not end the work that is still to be done."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        nobody_reads()


def print_written(written: list[Path], json_: bool) -> None:
    if not json_:
        say("written  " + ", ".join(str(path) for path in written))
