"""Commands that make a page with sliders: publish, app."""

from pathlib import Path

import simbrake as sb

from .._base._faults import Fault, InputError
from .._base._progress import Waiting
from . import _options as cli
from ._runs import title_of


def publish(
    file: cli.SceneFile,
    /,
    *,
    vary: cli.Many = None,
    out: cli.OutFile = None,
    limit: cli.Limits = None,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    json_: cli.Flag = False,
) -> int:
    """Solve a scene on a grid of up to three parameters and write a page with a slider for each of them.

    The page has the name of the scene's file, ending in _sliders.html, in the working folder or in that of --out.

    Parameters
    ----------
    vary
        PATH=LOW:HIGH:COUNT: a parameter, its range (SI, or with unit) and the number of solved points; up to three.
    json_
        Print {written, points, failed, gaps, deviation} as JSON, alone on stdout.
    """
    out = cli.file_in(out or Path(), f"{file.stem}_sliders.html")
    scene = cli.opened(file, set_, rtol, faults=cli.faults_of_file(out))
    from .._pages._publish import publish as publish_page
    from .._pages._publish import read_axes

    faults: list[Fault] = []
    axes = cli.attempt(faults, read_axes, scene, vary or [])
    limits = cli.attempt(faults, cli.limits_of, scene, limit, False)
    if faults or axes is None or limits is None:
        raise InputError(faults)
    with Waiting("publish", "compiling…") as told:
        title = title_of(file, file.read_text("utf-8"))
        found = publish_page(scene, axes, out, limits=limits, title=title, rtol=rtol, told=told)
    cli.tell(f"{found}\nwritten  {out}", lambda: {"written": str(out), **found.as_dict()}, json_)
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
) -> int:
    """Serve a page with a slider for every parameter of a scene, to this computer alone; ends with Ctrl+C.

    Parameters
    ----------
    port
        Port on 127.0.0.1; by default any that is free.
    open_
        Open the page in the browser.
    """
    faults = [] if 0 <= port < 65536 else [Fault("--port", f"{port} is out of range", "0…65535; 0: any free port")]
    scene = cli.opened(file, set_, rtol, faults=faults)
    from .._pages._app import App, Server

    limits, title = cli.limits_of(scene, limit, False), title_of(file, file.read_text("utf-8"))
    made = App(scene, limits, title, rtol)
    with Waiting("app", "compiling…"):
        sb.check(scene)
        made.warm()
    try:
        server = Server(made, port)
    except OSError as error:
        raise InputError([Fault("--port", f"{port} cannot be used: {error.strerror}", "give another port")]) from None
    cli.say(f"the app is at {server.address}\nfor this computer alone; Ctrl+C ends it")
    if open_:
        import webbrowser

        webbrowser.open_new_tab(server.address)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        cli.say("ended")
    finally:
        server.server_close()
    return 0


COMMANDS = {
    publish: "0 success, also where runs of the grid failed (they are gaps); 2 the input is wrong.",
    app: "0 ended by Ctrl+C; 2 the input is wrong.",
}
