"""The app: a page whose sliders run the scene, served by this computer to itself alone.

Served on 127.0.0.1 under an address with a random token; requests with another Host,
Origin or token are refused. One run at a time: a newer move cancels a longer run
between two of its stretches.
"""

import http.server
import json
import secrets
import threading
import time
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from .._base._faults import InputError
from .._base._numbers import scale
from .._base._part import Leaf, leaves
from ..files._scene_file import scene_text
from ..loads import Cylinder, Lever
from ..parts.scene import Scene, paths_without_meaning
from ..parts.scene_checks import check_scene
from ..runs.edit import with_values
from ..runs.measure import limit_checks
from ..runs.result import Result
from ..runs.simulate import simulate
from ..runs.verdict import Verdict
from ._live import Data, Detail, live, metric_rows, still
from ._page import head, lasted, render
from ._rows import BADGES

#: entries of a list of unequal numbers that have sliders
_ENTRIES = 24
#: bytes of a request
_LONGEST = 1_000_000
#: less than in a report, as it is found and sent with each move
_DETAIL = Detail(100, 150, 100)
#: seconds between two reports of progress
_TOLD = 0.2
#: runs before the first move, fewer (but two) where they take more than so many seconds
_WARM = 5
_WAIT = 10.0
#: seconds after which a silent client is let go
_PATIENCE = 30.0
_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class Superseded(Exception):
    """A newer move was made while this one ran."""


def slider_of(
    path: str, value: float, about: Any, ends: tuple[float, float] | None = None
) -> Data:
    """A slider: range within that of the parameter, numbers in SI, and how they are
    read in the unit shown.

    - `ends`: its range; by default from half to one and a half times the value, of 0 up
      to 1
    """
    low, high = ends or sorted((0.5 * value, 1.5 * value))
    high = high if high > low else low + 1.0
    if ends is None:
        low = max(low, -np.inf if about.low is None else about.low)
        high = min(high, about.high or np.inf)
    factor, offset, unit = scale(
        about.unit, max(abs(low), abs(high)), absolute=not about.difference
    )
    return {
        "path": path,
        "meaning": about.meaning,
        "value": value,
        "low": low,
        "high": high,
        "factor": factor,
        "offset": offset,
        "unit": unit or "–",
    }


def _numbers(leaf: Leaf) -> Iterator[tuple[str, float]]:
    """The sliders of a parameter: one for a number or for equal ones, else one for each
    of a few."""
    values = np.asarray(leaf.value, np.float64)
    if values.ndim == 0 or (values.size and np.ptp(values) == 0):
        yield leaf.path, float(values.flat[0])
    elif values.ndim == 1 and values.size <= _ENTRIES:
        yield from (
            (f"{leaf.path}[{i}]", value) for i, value in enumerate(values.tolist())
        )


#: numbers that decide first, by the ends of their paths, and the names that a driller
#: has for them
_FIRST = {
    "duty.load.mass": "Mass on the hook",
    "duty.load.string": "Mass of the string, first cycle",
    "duty.load.empty": "Mass of block and hook",
    "duty.load.profile.level": "Torque of the load",
    "initial.omega": "Drum speed at the start",
    "initial.hook_speed": "Hook speed at the start",
    "friction.coefficient": "Friction of the linings",
    "friction.base.coefficient": "Friction of the linings, cold",
    "friction.kinetic_coefficient": "Friction of the linings, sliding",
    "friction.base.kinetic_coefficient": "Friction of the linings, sliding, cold",
}
_GROUP = "What decides first"


def is_limit(leaf: Leaf) -> bool:
    """Whether a number is one that a run is compared with, and does not depend on."""
    return leaf.about.meaning.startswith(("allowable ", "permissible ", "limit: "))


def sliders(scene: Scene) -> list[Data]:
    """A slider for every parameter of a scene, in groups by its parts; counts and
    structure have none.

    The first group has mass, speed, full lever force and friction, by names that a
    driller uses.
    """
    absent = paths_without_meaning(scene)
    force = f"duty.{scene.duty.lever_field}"
    order = {_GROUP: -1, "duty": 0, "initial": 1, "brake": 2}
    controls = list[Data]()
    pulls = list[Data]()
    for leaf in leaves(scene):
        if leaf.path in absent:
            continue
        first: Data = {}
        if leaf.path.startswith(("duty.load", "initial", "brake.linings")):
            for end, name in _FIRST.items():
                if f".{leaf.path}".endswith(f".{end}"):
                    first = {"group": _GROUP, "name": name}
        for path, value in _numbers(leaf):
            group = leaf.path.rpartition(".")[0] or "scene"
            control = slider_of(path, value, leaf.about) | {"group": group}
            controls.append(control | first)
            if (
                leaf.path.startswith(force)
                and leaf.about.unit in ("N", "Pa")
                and not is_limit(leaf)
            ):
                pulls.append(controls[-1])
    if pulls:
        pull = max(pulls, key=lambda control: control["value"])
        lever = scene.duty.lever
        band = scene.duty.lever_field == "slack_tension"
        what = "Tension of the slack end" if band else "Force"
        if isinstance(lever, Lever):
            what = "Pull of the hand"
        elif isinstance(lever, Cylinder):
            what = "Pressure of the actuator"
        pull |= {"group": _GROUP, "name": f"{what}, full"}

    def place(control: Data) -> tuple[int, int]:
        load = control["path"].startswith("duty.load")
        part = control["path"].partition(".")[0]
        group = control["group"].partition(".")[0]
        decides = {"duty": 0 if load else 2, "initial": 1}.get(part, 3)
        return order.get(group, 3), decides if group == _GROUP else 0

    return sorted(controls, key=place)


class App:
    """The runs behind the page: one at a time, of which the latest counts."""

    def __init__(
        self, scene: Scene, limits: Mapping[str, float], title: str, rtol: float = 1e-10
    ) -> None:
        self.scene = scene
        self.limits = limits
        self.title = title
        self.rtol = rtol
        self._running = threading.Lock()
        self._counting = threading.Lock()
        self._latest = 0
        self.controls = sliders(scene)
        self._known = {control["path"] for control in self.controls}

    def page(self) -> str:
        """The page with the run of the scene as it is."""
        words = (
            "Each move is a run. Values in fields may leave the range of their slider."
        )
        with self._running:
            result = simulate(self.scene, rtol=self.rtol, throw=False)
            data = {
                "still": still(self.scene),
                "app": {"controls": self.controls},
                "run": self._run(result),
            }
            parts = head(result, limit_checks(result, self.limits), self.title)
        return render({**parts, "kind": "app", "panel": words, "data": data})

    def warm(self) -> None:
        """Compile all that a move needs: programs come quickly first, and better ones
        after a few runs."""
        begun = time.monotonic()
        for i in range(_WARM):
            if i < 2 or time.monotonic() - begun < _WAIT:
                _ = [*self.answers({})]

    @staticmethod
    def _run(result: Result) -> Data | None:
        return live(result, _DETAIL) if lasted(result) else None

    def edited(self, values: Any) -> Scene:
        """The scene with values of sliders. Raises `InputError` where they do not
        fit."""
        if not isinstance(values, dict) or not set(values) <= self._known:
            raise ValueError("not the values of sliders")
        if not all(
            isinstance(x, int | float) and not isinstance(x, bool)
            for x in values.values()
        ):
            raise ValueError("not numbers")
        if any(isinstance(x, int) and abs(x) > 2**1000 for x in values.values()):
            raise ValueError("more digits than a number has")
        return with_values(self.scene, {path: float(x) for path, x in values.items()})

    def answers(self, values: Any) -> Iterator[Data]:
        """Progress of a run, and its results or errors. Ends early where a newer move
        comes."""
        with self._counting:
            self._latest += 1
            mine = self._latest
        shares = [0.0]
        outcomes = list[Data]()
        ready = threading.Event()

        def tell(t: float, end: float) -> None:
            if mine != self._latest:
                raise Superseded
            shares.append((t - start) / max(end - start, 1e-300))

        def work() -> None:
            try:
                with self._running:
                    tell(start, end)
                    outcomes.append(self._answer(values, tell))
            except Superseded:
                outcomes.append({"superseded": True})
            except InputError as error:
                outcomes.append({"problem": "\n".join(map(str, error.faults))})
            except Exception as error:
                outcomes.append({"problem": f"{type(error).__name__}: {error}"})
            ready.set()

        start = float(self.scene.initial.time)
        end = float(self.scene.end_time)
        threading.Thread(target=work, daemon=True).start()
        while not ready.wait(_TOLD):
            yield {"progress": shares[-1]}
        yield outcomes[0]

    def _answer(self, values: Any, tell: Any) -> Data:
        result = simulate(
            self.edited(values), rtol=self.rtol, throw=False, progress=tell
        )
        parts = head(result, limit_checks(result, self.limits), self.title)
        verdict: Verdict = parts["verdict"]
        rows = []
        for row in verdict.rows:
            badge = BADGES[row.state.colour]
            cells = [row.heading, row.value, row.limit, row.margin]
            rows.append([*cells, str(row.state), badge])
        shown = {
            "colour": str(verdict.colour),
            "headline": f"{verdict.reason}: {verdict.headline}",
            "text": parts["outcome"],
            "rows": rows,
            "metrics": metric_rows(parts["figures"]),
        }
        return {"results": shown, "run": self._run(result)}

    def saved(self, values: Any) -> Data:
        """The scene with values of sliders as a scene file, or what is wrong with
        them."""
        try:
            scene = self.edited(values)
            title = " ".join(self.title.split())
            check_scene(scene)
            text = f"# {title}, changed in the app\n{scene_text(scene)}"
            return {"name": "scene.toml", "text": text}
        except InputError as error:
            return {"problem": "\n".join(map(str, error.faults))}


class Server(http.server.ThreadingHTTPServer):
    """The app on a port of 127.0.0.1, 0: any that is free; `address` has the token."""

    def __init__(self, app: App, port: int = 0) -> None:
        self.app = app
        self.token = secrets.token_urlsafe(24)
        super().__init__(("127.0.0.1", port), _Handler)
        self.hosts = {
            f"{name}:{self.server_port}" for name in ("127.0.0.1", "localhost")
        }

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/{self.token}/"


class _Handler(http.server.BaseHTTPRequestHandler):
    server: Server
    timeout = _PATIENCE

    def log_message(self, format: str, *args: Any) -> None:
        """Requests are not logged."""

    def _wanted(self) -> str | None:
        """Path below the token; `None`, and refused, where host, origin or token are
        not ours."""
        origin = self.headers.get("Origin")
        _, token, *rest = [*self.path.split("/", 2), ""]
        if self.headers.get("Host") not in self.server.hosts:
            self.send_error(403, "another host")
        elif (
            origin is not None
            and origin.removeprefix("http://") not in self.server.hosts
        ):
            self.send_error(403, "another origin")
        elif not secrets.compare_digest(token.encode(), self.server.token.encode()):
            self.send_error(404)
        else:
            return rest[0]
        return None

    def _begin(self, kind: str, length: int | None = None) -> None:
        self.send_response(200)
        headers = _HEADERS | {"Content-Type": f"{kind}; charset=utf-8"}
        if length is not None:
            headers["Content-Length"] = str(length)
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()

    def _send(self, text: str, kind: str) -> None:
        body = text.encode()
        self._begin(kind, len(body))
        self.wfile.write(body)

    def do_GET(self) -> None:
        wanted = self._wanted()
        if wanted == "":
            self._send(self.server.app.page(), "text/html")
        elif wanted is not None:
            self.send_error(404)

    def do_POST(self) -> None:
        wanted = self._wanted()
        length = self.headers.get("Content-Length", "")
        if wanted is None:
            return
        counted = length.isascii() and length.isdigit() and len(length) < 10
        asked = self.headers.get("Content-Type") == "application/json"
        if not asked or not counted or int(length) > _LONGEST:
            return self.send_error(400, "not a request of the page")
        try:
            values = json.loads(self.rfile.read(int(length)))["values"]
            self.server.app.edited(values)
        except InputError:
            pass  # told in the answer
        except TimeoutError:
            self.close_connection = True
            return None
        except (ValueError, KeyError, TypeError, RecursionError):
            return self.send_error(400, "not a request of the page")
        if wanted == "scene":
            self._send(json.dumps(self.server.app.saved(values)), "application/json")
        elif wanted == "run":
            self._begin("application/x-ndjson")
            try:
                for answer in self.server.app.answers(values):
                    text = json.dumps(answer, allow_nan=False, separators=(",", ":"))
                    self.wfile.write(f"{text}\n".encode())
                    self.wfile.flush()
            except (BrokenPipeError, ConnectionResetError):
                pass  # the page has made another move
        else:
            self.send_error(404)
        return None
