"""The body of `simbrake report`: a scene in, a page out."""

import ast
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .._base._faults import Fault, InputError
from .._base._progress import Waiting
from .._pages._page import report
from .._parts._scene import Scene
from .._run._measure import check_metrics, limit_checks, limit_dicts, limit_lines
from .._run._simulate import simulate
from ._cli_options import exit_code, limits_asked


def page_of(file: Path) -> Path:
    """Where the page goes if nobody says: the scene's name in the working folder, as a page."""
    return Path(f"{file.stem}.html")


def title_of(file: Path, text: str) -> str:
    """A heading for the page: the first line of what a scene's file says of itself, else its name."""
    if file.suffix == ".py":
        try:
            said = ast.get_docstring(ast.parse(text)) or ""
        except SyntaxError:
            said = ""
    else:
        said = (
            next((line.lstrip("# ") for line in text.splitlines() if line.strip()), "") if text.startswith("#") else ""
        )
    first = said.strip().partition("\n")[0].rstrip(".")
    return first or file.stem.replace("_", " ")


def report_run(
    scene: Scene,
    file: Path,
    out: Path | None,
    *,
    sensitivity: Sequence[str] = (),
    limit: Sequence[str] = (),
    fail_on_limit: bool = False,
    check: bool = True,
    rtol: float = 1e-10,
    json_: bool = False,
) -> int:
    """Runs the scene of `file`, writes its page and says where; the exit code: 0 the run reached its end, 1 it failed.

    - `limit`: texts `METRIC=VALUE`, in SI or with a unit; a limit that is exceeded is said, and makes the exit code 3
      with `fail_on_limit`.  The page is written in either case; faults raise `InputError` before anything is run
    """
    limits = _checked(scene, sensitivity, list(limit), fail_on_limit)
    out = page_of(file) if out is None else out
    if out.is_dir():
        raise InputError([Fault("--out", f"{out} is a folder", "give the name of a page, as in report.html")])
    text = file.read_text("utf-8") if file.is_file() else ""
    files: Mapping[str, str] = {file.name: text} if text else {}
    options: dict[str, Any] = {"sensitivity": sensitivity, "limits": limits, "check": check}
    with Waiting("report", "compiles the run") as told:
        result = simulate(scene, rtol=rtol, throw=False, progress=told)
        report(result, out, title=title_of(file, text), files=files, progress=told, **options)
        checks = limit_checks(result, limits)
    said: dict[str, Any] = {"status": result.status, "message": result.message, "written": str(out)}
    said["limits"] = limit_dicts(checks)
    lines = [f"{result.status}: {result.message}", *limit_lines(checks), f"written  {out}"]
    print(json.dumps(said, indent=2, allow_nan=False) if json_ else "\n".join(lines))
    return exit_code(result.ok, checks, fail_on_limit)


def _checked(scene: Scene, sensitivity: Sequence[str], limit: list[str], fail: bool) -> dict[str, float]:
    """Limits by metric. Raises one `InputError` with the faults of all options."""
    limits, faults = limits_asked(scene, limit, fail)
    try:
        check_metrics(scene, sensitivity)
    except InputError as error:
        faults += error.faults
    if faults:
        raise InputError(faults)
    return limits
