"""The body of `simbrake report`: a scene in, a page out."""

import ast
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .._base._faults import Fault, InputError
from .._base._progress import Waiting
from .._pages._html_limits import read_limits
from .._pages._html_report import report
from .._parts._scene import Scene
from .._run._measure import check_metrics
from .._run._simulate import simulate


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
    check: bool = True,
    rtol: float = 1e-10,
    json_: bool = False,
) -> int:
    """Runs the scene of `file`, writes its page and says where; the exit code: 0 the run reached its end, 1 it failed.

    - `limit`: texts `METRIC=VALUE`, in SI or with a unit.  The page is written in either case; faults raise
      `InputError` before anything is run
    """
    limits = _checked(scene, sensitivity, limit)
    out = page_of(file) if out is None else out
    if out.is_dir():
        raise InputError([Fault("--out", f"{out} is a folder", "give the name of a page, as in report.html")])
    text = file.read_text("utf-8") if file.is_file() else ""
    files: Mapping[str, str] = {file.name: text} if text else {}
    options: dict[str, Any] = {"sensitivity": sensitivity, "limits": limits, "check": check}
    with Waiting("report", "compiles the run") as told:
        result = simulate(scene, rtol=rtol, throw=False, progress=told)
        report(result, out, title=title_of(file, text), files=files, progress=told, **options)
    said: dict[str, Any] = {"status": result.status, "message": result.message, "written": str(out)}
    print(json.dumps(said, indent=2) if json_ else f"{result.status}: {result.message}\nwritten  {out}")
    return 0 if result.ok else 1


def _checked(scene: Scene, sensitivity: Sequence[str], limit: Sequence[str]) -> dict[str, float]:
    """Limits by metric. Raises one `InputError` with the faults of both options."""
    faults: list[Fault] = []
    given: dict[str, str] = {}
    for text in limit:
        name, _, value = (part.strip() for part in text.partition("="))
        if not name or not value:
            faults.append(Fault(f"--limit {text}", "is not of the form METRIC=VALUE", 'as in "max_tension=120 kN"'))
        elif name in given:
            faults.append(Fault(f"--limit {name}", "is given twice", "one limit each"))
        given |= {name: value} if name and value else {}
    try:
        check_metrics(scene, sensitivity)
    except InputError as error:
        faults += error.faults
    limits, wrong = read_limits(scene, given)
    faults += wrong
    if faults:
        raise InputError(faults)
    return limits
