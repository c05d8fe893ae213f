"""Commands about one scene or result: run, explain, report, animate, compare;
estimates, synthesis and materials."""

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

import simbrake as sb

from .._base._faults import Fault, InputError, Issues, input_error, needed
from .._base._progress import Progress
from ..files.shipped_scenes import scene_file, title_of
from . import _options as cli


def run(
    file: cli.SceneFile,
    /,
    *,
    out: cli.OutResult = None,
    json_: cli.Json = False,
    set_: cli.Set = None,
    limit: cli.Limits = None,
    fail_on_limit: cli.FailOnLimit = False,
    rtol: cli.Rtol = 1e-10,
    max_steps: int | None = None,
    max_events: int = 10_000,
    accuracy: cli.Flag = False,
    units: cli.Units = "si",
    measured: cli.Many = None,
) -> int:
    """Run a scene and print a summary.

    --out writes every figure of the run, the series (CSV), the result as labelled data (netCDF) and the summary.

    Parameters
    ----------
    measured
        CSV file with a recording of the same run (columns as hook_position [ft]): --out
        draws it over the run, in overlay.png; may be repeated.
    max_steps
        Maximum number of step attempts; by default as many as needed.
    max_events
        Maximum number of events.
    accuracy
        Run a second time, to estimate the errors of metrics, event times and states;
        and with finer layers of walls.
    """
    lost = Issues()
    counts = {"max_steps": max_steps, "max_events": max_events}
    ending = out.suffix if out and not out.is_dir() else ""
    if ending in (".parquet", ".csv", ".xlsx", ".mat"):
        hint = (
            "give .nc; docs/recipes/result_tables.py writes tables for other programs"
        )
        lost.add("--out", f"{ending} files of results went", hint)
    single = out if ending == ".nc" else None
    if measured and (single or not out):
        lost.add("--measured", "is drawn into a figure", "give its folder: --out")
    scene = cli.opened(
        file, set_, rtol, folder=None if single else out, faults=lost, **counts
    )
    from .._base._numbers import display_units
    from ..runs.measure import limit_checks, with_limits
    from ..runs.verdict import summary_with_limits, text_with_limits

    limits = cli.limits_of(scene, limit)
    scene = with_limits(scene, limits)
    recorded = sb.read_measured(*measured) if measured else None
    if recorded is not None:
        from ..studies.measured import check_measured

        check_measured(recorded, scene)  # pyright: ignore
    with Progress("run", "compiling…") as progress:
        result = sb.simulate(scene, rtol=rtol, **counts, throw=False, progress=progress)  # pyright: ignore
        progress.now("post-processing…")
        checks = limit_checks(result, limits)  # pyright: ignore
        verdict = result.verdict(checks)
        summary = summary_with_limits(result, checks)  # pyright: ignore
        with display_units(units):
            text = text_with_limits(result, checks)  # pyright: ignore
            if accuracy:
                progress.now("second run, for the errors")
                errors = result.accuracy()
                text = f"{text}\n{errors}"
                summary = {**summary, "accuracy": errors.as_dict()}
    cli.tell(text, json_, summary, cli.is_good(verdict))
    if recorded is not None and not json_:
        for note in recorded.notes:
            cli.say(f"measured {note}")
    if single is not None:
        cli.print_written([sb.save(result, single)], json_)
    elif out is not None:
        with sb.plot.titled(title_of(file)), display_units(units):
            written = sb.pages.write_run(result, out, checks)  # pyright: ignore
            if recorded is not None:
                with cli.whole_file(out / "overlay.png") as place:
                    sb.plot.overlay(result, recorded).savefig(place, dpi=130)
                written = [*written, out / "overlay.png"]
        cli.print_written(written, json_)
    return cli.exit_code(result.ok, fail_on_limit and verdict.fails)


def report(
    file: cli.SceneFile,
    /,
    *,
    out: cli.OutFile = None,
    sensitivity: cli.Many = None,
    limit: cli.Limits = None,
    fail_on_limit: cli.FailOnLimit = False,
    check: bool = True,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    units: cli.Units = "si",
    json_: cli.Flag = False,
) -> int:
    """Run a scene and write its report: one self-contained HTML page.

    The page has the name of the scene's file, ending in .html, in the working folder or
    in that of --out.

    Parameters
    ----------
    sensitivity
        Metric whose derivatives with respect to every parameter are shown, and its
        changes over ± 1 % of each; may be repeated.
    check
        Run a second time, to estimate the errors of the first run.
    json_
        Print {status, message, written, limits, verdict, accuracy} as JSON, alone on
        stdout.
    """
    out = cli.file_in(out or Path(), f"{file.stem}.html")
    scene = cli.opened(file, set_, rtol, faults=cli.faults_of_file(out))
    from ..runs.measure import limit_checks, with_limits
    from ..runs.verdict import head_lines, limit_dicts

    metrics = sensitivity or []
    title = title_of(file)
    files = {file.name: file.read_text("utf-8", errors="replace")}
    limits = cli.limits_of(scene, limit, metrics)
    with Progress("report", "compiling the run…") as progress:
        result = sb.simulate(
            with_limits(scene, limits),
            rtol=rtol,
            throw=False,
            progress=progress,  # pyright: ignore
        )
        if check:
            progress.now("second run, for the error estimate")
        errors = result.accuracy() if check else None
        with sb.plot.titled(title), sb.results.display_units(units):
            sb.report(
                result,
                out,
                title=title,
                files=files,
                progress=progress,
                sensitivity=metrics,
                limits=limits,
                check=errors or False,
            )  # pyright: ignore
        checks = limit_checks(result, limits)  # pyright: ignore
        verdict = result.verdict(checks)
    about = {
        "status": result.status,
        "message": result.message,
        "written": str(out),
        "limits": limit_dicts(checks),
        "verdict": verdict.as_dict(),
        "accuracy": errors and errors.as_dict(),
    }
    with sb.results.display_units(units):
        lines = head_lines(result, checks)  # pyright: ignore
    lines += [*([f"accuracy {errors.line}"] if errors else []), f"written  {out}"]
    cli.tell("\n".join(lines), json_, about, cli.is_good(verdict))
    return cli.exit_code(result.ok, fail_on_limit and verdict.fails)


def explain(
    file: Annotated[Path, Parameter(name="SCENE|RESULT", converter=cli.named_source)],
    /,
    *,
    limit: cli.Limits = None,
    fail_on_limit: cli.FailOnLimit = False,
    influence: bool = True,
    accuracy: cli.Flag = False,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    units: cli.Units = "si",
    json_: cli.Flag = False,
) -> int:
    """Explain a run in sentences: what happened, what governs it, which lining, limit
    and instability come first.

    Parameters
    ----------
    file
        Scene, as in simbrake run, or a result: a file or folder of simbrake run --out.
    influence
        Differentiate the run as well, to name the parameters that change it most.
    accuracy
        Run a second time, to estimate the errors of the first run.
    json_
        Print the findings with their numbers as JSON, alone on stdout.
    """
    with Progress("explain", "compiling the run…") as progress:
        if not file.is_dir() and scene_file(file, "*.nc").suffix.lower() in (
            ".toml",
            ".py",
        ):
            scene = cli.opened(file, set_, rtol)
            result = sb.simulate(scene, rtol=rtol, throw=False, progress=progress)  # pyright: ignore
        else:
            if set_:
                raise input_error(
                    "--set", "changes a scene, not a result", "give the scene file"
                )
            cli.prepare_jax()
            result = sb.results.rerun(file / "result.nc" if file.is_dir() else file)
        limits = cli.limits_of(result.scene, limit)  # pyright: ignore
        with sb.results.display_units("si" if json_ else units):
            explanation = sb.studies.explain(
                result,
                limits=limits,
                influence=influence,
                accuracy=accuracy,
                progress=progress,  # pyright: ignore
            )
    cli.tell(explanation, json_)
    return cli.exit_code(
        result.ok, fail_on_limit and explanation["outcome"].numbers["fails"]
    )


def export(
    file: cli.SceneFile,
    /,
    *,
    c: Path | None = None,
    fmu: Path | None = None,
    input_: Annotated[cli.Many, Parameter(name="--input")] = None,
    output: cli.Many = None,
    waiting: int = 64,
    set_: cli.Set = None,
    json_: cli.Flag = False,
) -> int:
    """Write a scene as C without dependencies: one C99 file, or an FMU with its sources
    and binary.

    Parameters
    ----------
    c
        The file, ending in .c, with the run and one step under held inputs; its name
        begins all names in it.
    fmu
        The FMU (FMI 2.0, co-simulation), ending in .fmu. It needs no Python where it
        runs.
    input_
        Input of the step, lever or load; may be repeated. By default both, as far as
        the scene can have them.
    output
        Metric of the run in C; may be repeated. By default slip_onset_time,
        full_slip_time and stopping_time.
    waiting
        How many commands can wait in a dead time.
    json_
        Print {written} as JSON, alone on stdout.
    """
    faults = Issues()
    if (c is None) == (fmu is None):
        faults.add("export", "writes one file", "give --c FILE.c or --fmu FILE.fmu")
    faults += [*cli.faults_of_file(c), *cli.faults_of_file(fmu)]
    scene = cli.opened(file, set_, faults=faults)
    with Progress("export", "printing…"):
        if c:
            out = sb.export_c(scene, c, inputs=input_, outputs=output, waiting=waiting)  # pyright: ignore
        else:
            out = sb.export.export_fmu(scene, str(fmu), input_, waiting=waiting)  # pyright: ignore
    cli.tell(f"written  {out}", json_, {"written": str(out)})
    return 0


def animate(
    file: cli.SceneFile,
    out: Annotated[Path, Parameter(name="FILE")],
    /,
    *,
    duration: float = 6.0,
    fps: int = 20,
    start: float | None = None,
    end: float | None = None,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    json_: cli.Flag = False,
) -> int:
    """Animate one stop: the pulley turns, linings are coloured by stick and slip and by
    temperature.

    Parameters
    ----------
    out
        The animation: .gif, or .html for a self-contained page in which it is played,
        stepped and hovered.
    duration
        Length of the animation (s).
    fps
        Frames per second.
    start
        Simulated time (s) at which it begins.
    end
        Simulated time (s) at which it ends; by default shortly after the stop.
    json_
        Print {status, message, written} as JSON, alone on stdout.
    """
    faults = Issues(cli.faults_of_file(out, ".gif", ".html"))
    faults.unless(0 < duration <= 600, "--duration", duration, "0…600 s")
    faults.unless(0 < fps <= 50, "--fps", fps, "1…50 frames a second")
    scene = cli.opened(file, set_, rtol, faults=faults)
    result = sb.simulate(scene, rtol=rtol, throw=False, progress=None)  # pyright: ignore
    if out.suffix.lower() == ".gif":
        sb.plot.animate(result, out, duration=duration, fps=fps, start=start, end=end)
    else:
        count = max(2, round(duration * fps))
        page = sb.pages.film_page(result, title_of(file), count, duration, start, end)
        with cli.whole_file(out) as place:
            place.write_text(page, "utf-8")
    about = {"status": result.status, "message": result.message, "written": str(out)}
    cli.tell(f"written  {out}", json_, about)
    return cli.exit_code(result.ok)


_Source = Annotated[Path, Parameter(converter=cli.named_source)]


def compare(
    a: _Source,
    b: _Source,
    /,
    *more: _Source,
    rtol: float = 1e-9,
    out: cli.Out = None,
    json_: cli.Json = False,
) -> int:
    """Compare results: differences of their scenes, and of all that was computed. The
    first one is the reference.

    --out writes a figure with the results laid over each other, compare.png, and the comparison, compare.json.

    Parameters
    ----------
    a
        Result file (.nc), folder of run --out, or a scene (.toml, .py), which is run.
    b
        Result or scene to compare with it.
    more
        Further ones, each compared with a.
    rtol
        Relative difference up to which numbers count as equal.
    """
    paths = [a, b, *more]
    for path in paths:
        if not path.is_dir():
            scene_file(path, "*.nc")
    if out is not None and out.exists() and not out.is_dir():
        raise input_error("--out", f"{out} is a file", "give a folder")
    cli.prepare_jax()

    def source(path: Path) -> Path | cli.Result:
        if path.suffix.lower() not in (".toml", ".py") or path.is_dir():
            return path
        return sb.simulate(cli.opened(path, None), throw=False, progress=progress)  # pyright: ignore

    with Progress("compare", "reading…") as progress:
        sources = [source(path) for path in paths]
        progress.now("comparing…")
        comparisons = [
            sb.compare(sources[0], other, rtol=rtol)
            for other in sources[1:]  # pyright: ignore
        ]
    stems = [path.stem or str(path) for path in paths]
    names = [
        stem if stems.count(stem) == 1 else str(path)
        for stem, path in zip(stems, paths, strict=True)
    ]
    equal = all(comparison.equal for comparison in comparisons)
    text = str(comparisons[0])
    data = comparisons[0].as_dict()
    if more:
        text = "\n\n".join(
            f"a: {names[0]}, b: {name}\n{comparison}"
            for name, comparison in zip(names[1:], comparisons, strict=True)
        )
        data = {
            "equal": equal,
            "results": names,
            "comparisons": [comparison.as_dict() for comparison in comparisons],
        }
    cli.tell(text, json_, data)
    if out is not None:
        labels = [
            f"{name}, {i}" if names.count(name) > 1 else name
            for i, name in enumerate(names, 1)
        ]
        named = dict(zip(labels, sources, strict=True))
        cli.print_written(sb.pages.write_comparison(data, named, out), json_)  # pyright: ignore
    return cli.exit_code(equal)


def estimates(
    file: cli.SceneFile,
    /,
    *,
    run: bool = True,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    json_: cli.Json = False,
) -> int:
    """Print the classical engineering estimates of a stop beside its simulation, and
    why they differ.

    Parameters
    ----------
    run
        Simulate the scene as well, to compare; with --no-run the estimates alone.
    """
    scene = cli.opened(file, set_, rtol)
    result = sb.simulate(scene, rtol=rtol, throw=False, progress=None) if run else None  # pyright: ignore
    table = sb.estimates(result or scene)  # pyright: ignore
    cli.tell(table, json_)
    return cli.exit_code(result is None or result.ok)


def synthesize(
    file: cli.SceneFile,
    /,
    *,
    run: bool = True,
    out: cli.OutFile = None,
    given: cli.Many = None,
    transmission: cli.Flag = False,
    fail_on_limit: cli.Flag = False,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    json_: cli.Flag = False,
) -> int:
    """Print the parametric synthesis of a stop in twelve steps, beside its simulation.

    Thermal penetration depth, Fourier numbers, volumes, heat partition, temperatures,
    properties at these, rational thickness of rim and lining, heat balance, stress,
    operating characteristics and permissible limits. --out writes it as synthesis.txt,
    or as JSON with --json or where the name of the file ends in .json.

    Parameters
    ----------
    run
        Simulate the scene as well, to compare; with --no-run the time and work are
        those of a classical stop.
    given
        NAME=VALUE: a size that the scene does not have, with its unit, as
        "rim_thickness=28 mm", a material by its name, as rim=cast_iron, or a limit, as
        "permissible.back=130 degC"; may be repeated.
    transmission
        Take the heat partition coefficient from heat transmission (S-41) instead of the
        scene's law or effusivities.
    fail_on_limit
        Exit with code 3 if the estimate or the run exceeds a permissible limit of step
        12, or the verdict on the run is no pass.
    json_
        Print the figures as JSON, alone on stdout: a list of {step, name, formula,
        value, unit, simulated, …}.
    """
    scene_file(file)
    cli.prepare_jax()
    from ..design.formulas.inputs import read_given
    from ..design.formulas.synthesis import faults_of_synthesis

    out = out and cli.file_in(out, "synthesis.json" if json_ else "synthesis.txt")
    faults = Issues(cli.faults_of_file(out))
    data, permissible = faults.attempt(read_given, given or []) or (
        None,
        sb.formulas.Permissible(),
    )
    scene = faults.attempt(cli.opened, file, set_, rtol)
    faults += [] if scene is None else faults_of_synthesis(scene, data, permissible)  # pyright: ignore
    scene = cli.checked(scene, faults)
    partition = sb.formulas.transmission_table() if transmission else None
    result = sb.simulate(scene, rtol=rtol, throw=False, progress=None) if run else None  # pyright: ignore
    synthesis = sb.synthesize(
        result or scene,
        data,
        permissible=permissible,
        partition=partition,  # pyright: ignore
    )
    fails = bool(synthesis.exceeded) or (
        fail_on_limit and result is not None and result.verdict().fails
    )
    cli.tell(synthesis, json_, synthesis.as_list())
    if out is not None:
        with cli.whole_file(out) as path:
            text = (
                cli.as_json(synthesis.as_list())
                if json_ or out.suffix == ".json"
                else str(synthesis)
            )
            path.write_text(text + "\n", "utf-8")
        cli.print_written([out], json_)
    return cli.exit_code(result is None or result.ok, fail_on_limit and fails)


_ENERGY = (
    'friction works, as in "400 kJ, 800 kJ", or a parameter of the scene, as in '
    '"initial.omega=12,24"'
)


def materials(
    file: cli.SceneFile,
    /,
    *,
    energy: str | None = None,
    rim: cli.Many = None,
    lining: cli.Many = None,
    run: bool = True,
    inertia: bool = False,
    fail_on_limit: cli.Flag = False,
    out: cli.OutFile = None,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    json_: cli.Json = False,
) -> int:
    """Compare materials of rim and linings for the duty of a scene: temperatures, heat
    partition, stress, wear, mass.

    --out writes a chart, materials.png; its own name may end in .png, .svg or .pdf.

    Parameters
    ----------
    energy
        Energy levels: friction works, as "400 kJ, 800 kJ", for each of which the
        initial speed is computed; or PATH=a,b,c: a parameter of the scene and its
        values. Without it: the scene as it is.
    rim
        Material of the rim; may be repeated. Without it: steel_20L, magnesium_alloy,
        brass, aluminium_alloy, cast_iron.
    lining
        Material of the linings; may be repeated. Without it: FK-24A, retinax.
    run
        Simulate each combination as well, where the scene has a rim in layers; with
        --no-run the estimates alone.
    inertia
        Let the pulley's inertia follow the mass of its rim.
    fail_on_limit
        Exit with code 3 if a pair exceeds a permissible temperature or stress of its
        materials.
    """
    out = out and cli.file_in(out, "materials.png")
    scene = cli.opened(
        file, set_, rtol, faults=cli.faults_of_file(out, ".png", ".svg", ".pdf")
    )
    from ..design.formulas.material_table import DEFAULT_LININGS, DEFAULT_RIMS

    levels = None if energy is None else _energy(scene, energy)
    names = rim or DEFAULT_RIMS, lining or DEFAULT_LININGS
    try:
        comparison = sb.compare_materials(
            scene,
            *names,
            energy=levels,
            run=run,
            inertia=inertia,
            rtol=rtol,  # pyright: ignore
        )
    except KeyError as error:
        raise input_error("--rim, --lining", error.args[0]) from None
    cli.tell(comparison, json_)
    if out is not None:
        with cli.whole_file(out) as path:
            sb.formulas.figures.materials(comparison).savefig(path, dpi=120)
        cli.print_written([out], json_)
    return cli.exit_code(
        True, fail_on_limit and not all(row.admissible for row in comparison)
    )


def _energy(scene: cli.Scene, text: str) -> list[float] | dict[str, list[float]]:
    """`--energy` in its forms. Raises `InputError` with all errors."""
    from .._base._part import leaves
    from .._base._quantity import NumberReader, Quantity

    path, _, numbers = (part.strip() for part in text.rpartition("="))
    scalars = {
        leaf.path: leaf.about
        for leaf in leaves(scene)
        if not getattr(leaf.value, "ndim", 0)
    }
    about = (
        scalars.get(path)
        if path
        else Quantity("J", "friction work", 0.0, open_low=True)
    )
    if about is None:
        raise input_error(
            "--energy", f"{path} is not a single number of the scene", _ENERGY
        )
    reader = NumberReader()
    values = [
        reader.number(number, about, "--energy", about.unit)
        for number in numbers.split(",")
    ]
    if reader.faults:
        raise InputError(
            [Fault(fault.path, fault.problem, _ENERGY) for fault in reader.faults]
        )
    return {path: values} if path else values


# --- pages with sliders -------------------------------------------------------------


def publish(
    file: cli.SceneFile,
    /,
    *,
    vary: cli.Many = None,
    live: cli.Flag = False,
    out: cli.OutFile = None,
    limit: cli.Limits = None,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    json_: cli.Flag = False,
) -> int:
    """Write a page that runs the scene in the browser of its reader at every move of a
    slider. Needs simbrake[live].

    The page has the name of the scene's file, ending in _sliders.html, in the working
    folder or in that of --out.

    Parameters
    ----------
    vary
        PATH=LOW:HIGH: a parameter that has a slider, and its range (SI, or with unit);
        may be repeated. By default all.
    live
        Changes nothing any more: every page runs its scene.
    json_
        Print {written, sliders, metrics, program, size} as JSON, alone on stdout.
    """
    out = cli.file_in(out or Path(), f"{file.stem}_sliders.html")
    if live:
        print(
            "note: --live has no effect: every page of publish runs its scene",
            file=sys.stderr,
        )
    faults = Issues(cli.faults_of_file(out))
    faults.attempt(
        needed,
        "ziglang",
        "compiles the page (simbrake report and simbrake app need none)",
        "live",
    )
    form = "PATH=LOW:HIGH, as in initial.omega=10:30"
    requested = cli.assignments("--vary", form, vary, cli.bounds, faults)
    scene = faults.attempt(cli.opened, file, set_, rtol)
    ranges = cli.in_si(scene, "--vary", requested, faults)
    limits = (scene and faults.attempt(cli.limits_of, scene, limit)) or {}
    from .._base._part import leaves
    from ..runs.edit import entry_of

    there = {leaf.path for leaf in leaves(scene)}
    for path, (low, high) in ranges.items():
        if entry_of(path)[0] not in there:
            faults.add(path, "is absent in this scene", "give the scene a value of it")
        elif not low < high:
            faults.add(
                f"--vary {path}",
                "its low end is not below its high one",
                "give LOW:HIGH",
            )
    scene = cli.checked(scene, faults)
    title = title_of(file)

    with Progress("publish", "compiling…") as progress:
        published = sb.pages.publish(
            scene,
            ranges,
            out,
            limits=limits,
            title=title,
            rtol=rtol,
            progress=progress,  # pyright: ignore
        )
    cli.tell(
        f"{published}\nwritten  {out}",
        json_,
        {"written": str(out), **published._asdict()},
    )
    return 0


def app(
    file: cli.SceneFile,
    /,
    *,
    port: int = 0,
    open_: cli.Flag = False,
    limit: cli.Limits = None,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    json_: cli.Flag = False,
) -> int:
    """Serve a page with a slider for every parameter of a scene, on localhost only;
    ends with Ctrl+C.

    Parameters
    ----------
    port
        Port on 127.0.0.1; by default any that is free.
    open_
        Open the page in the browser.
    json_
        Print {address} as JSON as soon as the page is served, alone on stdout.
    """
    faults = Issues()
    faults.unless(0 <= port < 65536, "--port", port, "0…65535; 0: any free port")
    scene = cli.opened(file, set_, rtol, faults=faults)

    limits = cli.limits_of(scene, limit)
    slider_app = sb.pages.App(scene, limits, title_of(file), rtol)  # pyright: ignore
    with Progress("app", "compiling…"):
        sb.check_scene(scene)  # pyright: ignore
        slider_app.warm()
    try:
        server = sb.pages.Server(slider_app, port)
    except OSError as error:
        raise input_error(
            "--port", f"{port} cannot be used: {error.strerror}", "give another port"
        ) from None
    words = f"the app is at {server.address}\nfor this computer alone; Ctrl+C ends it"
    cli.tell(words, json_, {"address": server.address})
    if open_:
        import webbrowser

        webbrowser.open_new_tab(server.address)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        if not json_:
            cli.say("ended")
    finally:
        server.server_close()
    return 0


_LIMIT = (
    "3 the verdict is red, or the run did not show what it was to show (only with "
    "--fail-on-limit)."
)
_RUN = f"0 the run reached its end; 1 it failed, with a named code; 2 the input is wrong; {_LIMIT}"
#: commands and their exit codes
COMMANDS = {
    run: _RUN,
    explain: _RUN,
    report: _RUN,
    export: "0 success; 1 the run failed; 2 the input is wrong.",
    animate: "0 the run reached its end; 1 it failed; 2 the input is wrong.",
    compare: "0 equal within the tolerance; 1 different; 2 the input is wrong.",
    estimates: "0 success; 1 the run failed; 2 the input is wrong.",
    synthesize: f"0 success; 1 the run or the synthesis failed; 2 the input is wrong; {_LIMIT}",
    materials: f"0 success; 1 a run failed; 2 the input is wrong; {_LIMIT}",
    publish: "0 success; 2 the input is wrong.",
    app: "0 ended by Ctrl+C; 2 the input is wrong.",
}
