"""Figures of several runs, drawn from data made by hand: results laid over each other,
metrics over parameters."""

import math

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_hex
from picture_scenes import CYCLE

import simbrake as sb
from simbrake import plot

# --- results laid over each other ----------------------------------------------------


def data_of(columns, events=(), status="stopped", end=4.0, start=0.0):
    """The data of a run that slows evenly from 10 rad/s; `columns`: name → unit and
    values at the two ends."""
    t = np.linspace(start, end, 5)
    given = {
        "omega": ("rad/s", 10.0 - 2.0 * (t - start)),
        "brake_torque": ("N*m", np.linspace(1e3, 3e3, 5)),
    } | columns
    found = {
        name: (
            (("time", "lining") if np.ndim(y) == 2 else ("time",)),
            np.asarray(y),
            {"units": unit},
        )
        for name, (unit, y) in given.items()
    }
    found |= {
        "event_name": ("event", np.asarray([name for name, _ in events], str)),
        "event_time": ("event", np.asarray([time for _, time in events], float)),
        "status": ((), status),
    }
    return xr.Dataset(found, {"time": t})


BAND = {
    "tight_tension": ("N", np.linspace(2e4, 6e4, 5)),
    "slack_tension": ("N", np.linspace(1e3, 5e3, 5)),
}


def test_compare_marks_events():
    """Seven marks of one kind are too many; the first run ends at rest after 2 s of its
    4 s, the other one does not."""
    many = [("full_slip", 0.1 * i) for i in range(7)]
    one = data_of(BAND, [("slip_onset", 0.5), ("stop", 1.0), ("stop", 2.0), *many])
    other = data_of(BAND, [("stop", 1.0), *many[:6]], "not_stopped", 3.0)
    figure = plot.compare([one, other])
    speed, torque, tension = figure.axes
    assert tension.get_xlim() == (0.0, 3.0)
    assert plot.compare([one, one]).axes[0].get_xlim() == (0.0, pytest.approx(2.3))
    marks = {
        (line.get_marker(), to_hex(line.get_color())): line.get_xydata().tolist()
        for line in speed.lines
        if line.get_linestyle() == "None" and len(line.get_xdata())
    }
    a, b = (to_hex(colour) for colour in CYCLE[:2])
    assert marks.keys() == {("o", a), ("D", a), ("D", b), ("s", b)}
    np.testing.assert_allclose(marks["o", a], [[0.5, 9.0]])
    np.testing.assert_allclose(marks["D", a], [[1.0, 8.0], [2.0, 6.0]])
    np.testing.assert_allclose(
        marks["s", b], [[0.1 * i, 10.0 - 0.2 * i] for i in range(6)]
    )
    for axes, factor, column in (
        (torque, 1e-3, "brake_torque"),
        (tension, 1e-3, "tight_tension"),
    ):
        for line, data in zip(axes.lines, (one, other), strict=True):
            np.testing.assert_allclose(
                line.get_xydata(),
                np.stack([data["time"], factor * data[column]], axis=1),
            )


# --- metrics over parameters --------------------------------------------------------


def study(dims, coords, metrics, sequence, code):
    """The data of a study; `metrics`: name → unit and values."""
    about = {"units": "1", "meaning": "of the run"}
    found = {
        name: (dims, np.asarray(values, float), {"units": unit})
        for name, (unit, values) in metrics.items()
    }
    found |= {
        "sequence": (dims, np.asarray(sequence), about),
        "code": (dims, np.asarray(code), about),
    }
    return xr.Dataset(found, coords)


MASS = ("load.mass", np.array([1e4, 2e4, 3e4, 5e4]), {"units": "kg"})
SPEED = ("speed", np.array([1.0, 2.0, 4.0]), {"units": "rad/s"})


def line_study(**more):
    metrics = {
        "peak_rim_temperature": ("K", 273.15 + np.array([20.0, 40.0, 50.0, 90.0])),
        "stopping_time": ("s", [1.0, 2.0, math.nan, 4.0]),
        "steady": ("N", [5.0, 5.0, 5.0, 5.0]),
    } | more
    return study("load.mass", {"load.mass": MASS}, metrics, [0, 0, 1, 1], [0, 0, 0, 0])


def test_sweep_over_one_parameter():
    data = line_study()
    figure = plot.sweep(data)
    time, rim = figure.axes  # usual metrics first; what is steady is left out
    one, other, bridge = (
        rim.lines
    )  # a curve for each sequence of events, dotted from one to the next
    np.testing.assert_allclose(one.get_xydata(), [[10, 20], [20, 40]])
    np.testing.assert_allclose(other.get_xydata(), [[30, 50], [50, 90]])
    np.testing.assert_allclose(bridge.get_xydata(), [[20, 40], [30, 50]])
    assert [line.get_linestyle() for line in rim.lines] == ["-", "-", ":"]
    assert [len(line.get_xdata()) for line in time.lines] == [2, 2]
    (cell,) = time.patches
    assert (cell.get_x(), cell.get_x() + cell.get_width()) == pytest.approx(
        (25.0, 40.0)
    )
    assert not rim.patches
    # a run that failed has no values that count
    failed = data.assign(code=("load.mass", [0, 4, 0, 0]))
    figure = plot.sweep(failed, ["peak_rim_temperature"])
    (cell,) = figure.axes[0].patches
    assert (cell.get_x(), cell.get_x() + cell.get_width()) == pytest.approx(
        (15.0, 25.0)
    )


def test_sweep_over_two_parameters():
    """Values 10 x + y in g; at the corner nothing, in the second row of masses another
    sequence."""
    z = 10.0 * MASS[1][:, None] / 1e3 + SPEED[1]
    z[3, 0] = math.nan
    sequence = [[0, 0, 0], [1, 1, 2], [1, 1, 2], [1, 1, 2]]
    dims = ("load.mass", "speed")
    coords = {"load.mass": MASS, "speed": SPEED}
    data = study(
        dims,
        coords,
        {"a": ("s", z), "b": ("s", 2.0 * z), "c": ("s", -z)},
        sequence,
        np.zeros((4, 3), int),
    )
    figure = plot.sweep(data)
    a, b, c, _ = figure.axes
    for axes in (a, b, c):
        assert (axes.get_xlim(), axes.get_ylim()) == ((10.0, 50.0), (1.0, 4.0))
        (failed,) = axes.patches
        assert failed.get_gid() == "failed"
        corners = {tuple(xy) for xy in failed.get_xy().round(9).tolist()}
        assert corners == {(40.0, 1.0), (50.0, 1.0), (50.0, 1.5), (40.0, 1.5)}
        (edges,) = [one for one in axes.collections if one.get_gid() == "sequence"]
        drawn = {
            tuple(map(tuple, np.round(one, 9).tolist())) for one in edges.get_segments()
        }
        x = [10.0, 15.0, 25.0, 40.0, 50.0]
        y = [1.0, 1.5, 3.0, 4.0]
        across = {((x[1], y[j]), (x[1], y[j + 1])) for j in range(3)}
        along = {((x[i], y[2]), (x[i + 1], y[2])) for i in (1, 2, 3)}
        assert drawn == across | along
    # contours run along 10 x + y
    line = max((p for p in a.collections[1].get_paths()), key=lambda p: len(p.vertices))
    along = 10.0 * line.vertices[:, 0] + line.vertices[:, 1]
    levels = a.collections[0].levels
    assert (
        np.ptp(along) < 1e-6
        or np.min(np.abs(np.subtract.outer(along, levels)), axis=1).max() < 1e-6
    )


def test_permissible_map():
    """Of planes x and y over a grid: the region is that of both limits, lines lie where
    a metric is its limit."""
    x = np.linspace(1.0, 3.0, 5)
    y = np.linspace(10.0, 20.0, 6)
    along = np.broadcast_to(x[:, None], (5, 6))
    up = np.broadcast_to(y, (5, 6)).copy()
    up[4, 5] = np.inf  # it does not stop there
    data = xr.Dataset(
        {
            "hook_travel": (("a", "b"), along, {"units": "m"}),
            "min_holding_reserve": (("a", "b"), up, {"units": "1"}),
            "code": (("a", "b"), np.zeros((5, 6), int)),
        },
        {"a": ("a", x, {"units": "m"}), "b": ("b", y, {"units": "s"})},
    )
    figure = plot.permissible(data, {"hook_travel": 2.2, "min_holding_reserve": 13.0})
    (axes,) = figure.axes
    mesh = axes.collections[0].get_array()
    n = len(mesh)
    u, v = np.meshgrid(np.linspace(1, 3, n), np.linspace(10, 20, n))
    blank = (u > 2.5) & (v > 18.0)
    assert np.ma.getmaskarray(mesh)[blank].all()
    inside = (
        (~(u >= 2.5) | ~(v >= 18.0))
        & (np.abs(u - 2.2) > 1e-9)
        & (np.abs(v - 13.0) > 1e-9)
    )
    np.testing.assert_array_equal(
        np.ma.getdata(mesh)[inside].astype(bool), ((u <= 2.2) & (v >= 13.0))[inside]
    )
    lines = [
        path.vertices for part in axes.collections[1:3] for path in part.get_paths()
    ]
    np.testing.assert_allclose(lines[0][:, 0], 2.2, rtol=1e-9)
    np.testing.assert_allclose(lines[1][:, 1], 13.0, rtol=1e-9)
    with pytest.raises(sb.InputError, match="is no grid of two parameters"):
        plot.permissible(data.isel(a=0), {"hook_travel": 1.0})
    with pytest.raises(sb.InputError, match="the data is without max_tension"):
        plot.permissible(data, {"max_tension": 1.0})


def test_sweep_of_an_ensemble():
    mass = ("run", np.array([1e4, 2e4, 3e4, 5e4]), {"units": "kg"})
    speed = ("run", [1.0, 3.0, 2.0, 4.0], {"units": "rad/s"})
    metrics = {
        "a": ("s", [4.0, 3.0, math.nan, 1.0]),
        "b": ("", [1.0, 2.0, 3.0, 4.0]),
        "c": ("s", [1.0] * 3 + [2.0]),
    }
    names = ("run", np.arange(4))
    data = study(
        "run",
        {"load.mass": mass, "speed": speed, "run": names},
        metrics,
        [0, 0, 1, 1],
        [0, 0, 0, 2],
    )
    figure = plot.sweep(data)
    panels = np.reshape(figure.axes, (3, 2))
    for row, values in zip(
        panels,
        ([4.0, 3.0, math.nan, math.nan], [1.0, 2.0, 3.0, math.nan]),
        strict=False,
    ):
        for axes, x in zip(row, ([10, 20, 30, 50], [1, 3, 2, 4]), strict=True):
            np.testing.assert_allclose(
                axes.lines[0].get_xydata(), np.stack([x, values], axis=1)
            )
            assert not axes.patches
