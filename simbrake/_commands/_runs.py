"""Commands about one scene or result: run, explain, report, animate, compare; estimates, synthesis and materials."""

import ast
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

import simbrake as sb

from .._base._faults import Fault, InputError
from .._base._progress import Waiting
from . import _options as cli


def run(
    scenario: cli.Scenario,
    /,
    *,
    out: cli.Out = None,
    json_: cli.Json = False,
    set_: cli.Set = None,
    limit: cli.Limits = None,
    fail_on_limit: cli.FailOnLimit = False,
    rtol: cli.Rtol = 1e-10,
    max_steps: cli.MaxSteps = None,
    max_events: int = 10_000,
    units: cli.Units = "si",
    measured: cli.Many = None,
) -> int:
    """Run a scenario and print a summary.

    Parameters
    ----------
    measured
        CSV file with a recording of the same run (columns as hook_position [ft]); --out then has overlay.png as well.
        May be repeated.
    out
        Folder for every figure of the run, the series (CSV), the result as labelled data (netCDF) and the summary.
    max_events
        Events allowed.
    """
    lost = [Fault("--measured", "is drawn into a figure", "give its folder: --out")] if measured and not out else []
    counts = {"max_steps": max_steps, "max_events": max_events}
    scene = cli.opened(scenario, set_, rtol, folder=out, faults=lost, **counts)
    from .._base._table import shown_in
    from .._run._measure import limit_checks, summary_with_limits, text_with_limits
    from ..studies._measured import check_measured

    limits = cli.limits_of(scene, limit, fail_on_limit)
    recorded = sb.read_measured(*measured) if measured else None
    if recorded is not None:
        check_measured(recorded, scene)
    with Waiting("run", "compiling…") as told:
        result = sb.simulate(scene, rtol=rtol, max_steps=max_steps, max_events=max_events, throw=False, progress=told)
        told.now("post-processing…")
        checks = limit_checks(result, limits)
        summary = summary_with_limits(result, checks)
        with shown_in(units):
            text = text_with_limits(result, checks)
    cli.tell(text, lambda: summary, json_)
    if out is not None:
        from .._pages._page import write as write_run

        written = write_run(result, out, None, checks)
        if recorded is not None:
            with shown_in(units):
                sb.plot.overlay(result, recorded).savefig(out / "overlay.png", dpi=130)
            written = [*written, out / "overlay.png"]
        cli.print_written(written, json_)
    return cli.exit_code(result.ok, fail_on_limit and cli.any_exceeded(checks))


def report(
    scenario: cli.Scenario,
    /,
    *,
    out: cli.Out = None,
    sensitivity: cli.Many = None,
    limit: cli.Limits = None,
    fail_on_limit: cli.FailOnLimit = False,
    check: bool = True,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    json_: cli.Flag = False,
) -> int:
    """Run a scene and write its report: one self-contained HTML page.

    Parameters
    ----------
    out
        The page; by default the scene's name with .html in the working folder. An existing one is replaced whole.
    sensitivity
        Metric whose derivatives by every parameter are shown; may be repeated.
    check
        Run a second time at another tolerance, to estimate the error of the first run.
    json_
        Print {status, message, written, limits, verdict} as JSON, alone on stdout.
    """
    out = out or Path(f"{scenario.stem}.html")
    scene = cli.opened(scenario, set_, rtol, faults=cli.faults_of_file(out))
    from .._run._measure import limit_checks, limit_dicts, limit_lines

    metrics, text = sensitivity or [], scenario.read_text("utf-8")
    title, files = title_of(scenario, text), {scenario.name: text}
    limits = cli.limits_of(scene, limit, fail_on_limit, metrics)
    with Waiting("report", "compiling the run…") as told:
        result = sb.simulate(scene, rtol=rtol, throw=False, progress=told)
        sb.report(result, out, sensitivity=metrics, limits=limits, title=title, files=files, check=check, progress=told)
        checks = limit_checks(result, limits)
        verdict = result.verdict(checks)
    said = {"status": result.status, "message": result.message, "written": str(out), "limits": limit_dicts(checks)}
    said |= {"verdict": verdict.as_dict()}
    lines = [f"{result.status}: {result.message}", f"verdict  {verdict}", *limit_lines(checks), f"written  {out}"]
    cli.tell("\n".join(lines), lambda: said, json_)
    return cli.exit_code(result.ok, fail_on_limit and cli.any_exceeded(checks))


def explain(
    scenario: Annotated[Path, Parameter(help="Scene file, or result file or folder of `run --out`.")],
    /,
    *,
    limit: cli.Limits = None,
    fail_on_limit: cli.FailOnLimit = False,
    influence: bool = True,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    json_: cli.Json = False,
) -> int:
    """Explain a run in sentences: what happened, what governs it, which lining, limit and instability come first.

    Parameters
    ----------
    influence
        Differentiate the run as well, to name the parameters that change it most.
    """
    with Waiting("explain", "compiling the run…") as told:
        if scenario.suffix.lower() in (".toml", ".py") and not scenario.is_dir():
            scene = cli.opened(scenario, set_, rtol)
            result = sb.simulate(scene, rtol=rtol, throw=False, progress=told)
        else:
            faults = [Fault("--set", "changes a scene, not a result", "give the scene file")] if set_ else []
            if faults:
                raise InputError(faults)
            cli.prepare_jax()
            result = sb.results.rerun(scenario / "result.nc" if scenario.is_dir() else scenario)
        limits = cli.limits_of(result.scene, limit, fail_on_limit)
        found = sb.results.explain(result, limits=limits, influence=influence, progress=told)
    cli.tell(found, found.as_dict, json_)
    return cli.exit_code(result.ok, fail_on_limit and found["outcome"].numbers["exceeded"] > 0)


def title_of(file: Path, text: str) -> str:
    """Heading of a report: the first line of the docstring or comment of a scene's file, else its name."""
    if file.suffix == ".py":
        try:
            said = ast.get_docstring(ast.parse(text)) or ""
        except SyntaxError:
            said = ""
    else:
        said = next(iter(text.splitlines()), "").lstrip("# ") if text.startswith("#") else ""
    return said.strip().partition("\n")[0].rstrip(".") or file.stem.replace("_", " ")


def animate(
    scenario: cli.Scenario,
    out: Path,
    /,
    *,
    duration: float = 6.0,
    fps: int = 20,
    start: float | None = None,
    end: float | None = None,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
) -> int:
    """Animate one stop: the pulley turns, linings are coloured by stick and slip and by temperature.

    Parameters
    ----------
    out
        The animation: .gif, or .html for a self-contained page with a slider.
    duration
        Length of the animation (s).
    fps
        Frames per second.
    start
        Simulated time (s) at which it begins.
    end
        Simulated time (s) at which it ends; by default shortly after the stop.
    """
    faults = cli.faults_of_file(out, ".gif", ".html")
    if not 0 < duration <= 600:
        faults.append(Fault("--duration", f"{duration} is out of range", "0…600 s"))
    scene = cli.opened(scenario, set_, rtol, faults=faults)
    result = sb.simulate(scene, rtol=rtol, throw=False, progress=None)
    sb.plot.animate(result, out, duration=duration, fps=fps, start=start, end=end)
    cli.print_written([out], False)
    return cli.exit_code(result.ok)


def compare(a: Path, b: Path, /, *, rtol: float = 1e-9, json_: cli.Json = False) -> int:
    """Compare two results: differences of the scenes and of the results. Exit code 0: equal, 1: different.

    Parameters
    ----------
    a
        Result file (.nc, .parquet, .csv), folder of `run --out`, or a scene (.toml, .py), which is run.
    b
        The same.
    rtol
        Relative difference up to which numbers count as equal.
    """
    cli.prepare_jax()

    def source(path: Path) -> Path | cli.Result:
        if path.suffix.lower() not in (".toml", ".py") or path.is_dir():
            return path
        return sb.simulate(cli.opened(path, None), throw=False, progress=told)

    with Waiting("compare", "reading…") as told:
        sources = source(a), source(b)
        told.now("comparing…")
        found = sb.compare(*sources, rtol)
    cli.tell(found, found.as_dict, json_)
    return cli.exit_code(found.equal)


def estimates(
    scenario: cli.Scenario,
    /,
    *,
    run: bool = True,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    json_: cli.Json = False,
) -> int:
    """Print the classical engineering estimates of a stop beside its simulation, and why they differ."""
    scene = cli.opened(scenario, set_, rtol)
    with Waiting("estimates", "compiling…") as told:
        result = sb.simulate(scene, rtol=rtol, throw=False, progress=told) if run else None
        told.now("estimates")
        table = sb.estimates(result or scene)
    cli.tell(table, table.as_dict, json_)
    return cli.exit_code(result is None or result.ok)


def synthesize(
    scenario: cli.Scenario,
    /,
    *,
    run: cli.Simulate = True,
    out: cli.Out = None,
    given: cli.Many = None,
    transmission: cli.Flag = False,
    fail_on_limit: cli.Flag = False,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    json_: cli.Flag = False,
) -> int:
    """Print the parametric synthesis of a stop in twelve steps, beside its simulation.

    Thermal penetration depth, Fourier numbers, volumes, heat partition, temperatures, properties at these, rational
    thickness of rim and lining, heat balance, stress, operating characteristics and permissible limits.

    Parameters
    ----------
    out
        File for the report (JSON with --json or where its name ends in .json). An existing one is replaced whole.
    given
        NAME=VALUE: a parameter that the scene does not have, with its unit, as "rim_thickness=28 mm", a material by its
        name, as rim=cast_iron, or a limit, as "permissible.back=130 degC"; may be repeated.
    transmission
        Take the heat partition coefficient from heat transmission (S-41) instead of the scene's law or effusivities.
    fail_on_limit
        Exit with code 3 if the estimate or the run exceeds a permissible limit of step 12.
    json_
        Print the figures as JSON, alone on stdout: a list of {step, name, formula, value, unit, simulated, …}.
    """
    cli.prepare_jax()
    from ..formulas._inputs import read_given
    from ..formulas._synthesis import faults_of_synthesis

    faults = cli.faults_of_file(out)
    data, permissible = cli.attempt(faults, read_given, given or []) or (None, sb.formulas.Permissible())
    also = lambda scene: faults_of_synthesis(scene, data, permissible)  # noqa: E731
    scene = cli.opened(scenario, set_, rtol, faults=faults, also=also)
    partition = sb.formulas.transmission_table() if transmission else None
    with Waiting("run", "compiling and running…"):
        result = sb.simulate(scene, rtol=rtol, throw=False) if run else None
        found = sb.synthesize(result or scene, data, permissible=permissible, partition=partition)
    cli.tell(found, found.as_list, json_)
    if out is not None:
        with cli.whole_file(out) as path:
            text = cli.as_json(found.as_list()) if json_ or out.suffix == ".json" else str(found)
            path.write_text(text + "\n", "utf-8")
        cli.print_written([out], json_)
    return cli.exit_code(result is None or result.ok, fail_on_limit and bool(found.exceeded))


_ENERGY = 'friction works, as in "400 kJ, 800 kJ", or a parameter of the scene, as in "initial.omega=12,24"'


def materials(
    scenario: cli.Scenario,
    /,
    *,
    energy: str | None = None,
    rim: cli.Many = None,
    lining: cli.Many = None,
    run: bool = True,
    inertia: bool = False,
    fail_on_limit: cli.Flag = False,
    out: cli.Out = None,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    json_: cli.Json = False,
) -> int:
    """Compare materials of rim and linings for the duty of a scene: temperatures, heat partition, stress, wear, mass.

    Parameters
    ----------
    energy
        Energy levels: friction works ("400 kJ, 800 kJ"), for which the initial speed is sought, or PATH=a,b,c, a
        parameter of the scene and its values. Without it: the scene as it is.
    rim
        Name of a rim's material; may be repeated. Without it: steel_20L, magnesium_alloy, brass, aluminium_alloy,
        cast_iron.
    lining
        Name of a lining's material; may be repeated. Without it: FK-24A, retinax.
    run
        Simulate each combination as well, where the scene's heat has a rim in layers; without it estimates alone.
    inertia
        Let the pulley's inertia follow the mass of its rim.
    fail_on_limit
        Exit with code 3 if a pair exceeds a permissible temperature or stress of its materials.
    out
        Chart of the comparison (.png, .svg or .pdf).
    """
    scene = cli.opened(scenario, set_, rtol, faults=cli.faults_of_file(out, ".png", ".svg", ".pdf"))
    from ..formulas._material_table import DEFAULT_LININGS, DEFAULT_RIMS

    levels = None if energy is None else _energy(scene, energy)
    names = rim or DEFAULT_RIMS, lining or DEFAULT_LININGS
    try:
        found = sb.compare_materials(scene, *names, energy=levels, run=run, inertia=inertia, rtol=rtol)
    except KeyError as error:
        raise InputError([Fault("--rim, --lining", error.args[0])]) from None
    cli.tell(found, found.as_dict, json_)
    if out is not None:
        with cli.whole_file(out) as path:
            sb.plot.materials(found).savefig(path, dpi=120)
        cli.print_written([out], json_)
    return cli.exit_code(True, fail_on_limit and not all(row.admissible for row in found))


def _energy(scene: cli.Scene, text: str) -> list[float] | dict[str, list[float]]:
    """`--energy` in its forms. Raises `InputError` with all errors."""
    from .._base._quantity import NumberReader, Quantity, leaves

    path, _, given = (part.strip() for part in text.rpartition("="))
    known = {leaf.path: leaf.about for leaf in leaves(scene) if not getattr(leaf.value, "ndim", 0)}
    about = known.get(path) if path else Quantity("J", "friction work", 0.0, open_low=True)
    if about is None:
        raise InputError([Fault("--energy", f"{path} is not a single number of the scene", _ENERGY)])
    reader = NumberReader()
    values = [reader.number(one, about, "--energy", about.unit) for one in given.split(",")]
    if reader.faults:
        raise InputError([Fault(fault.path, fault.problem, _ENERGY) for fault in reader.faults])
    return {path: values} if path else values


COMMANDS = (run, explain, report, animate, compare, estimates, synthesize, materials)
