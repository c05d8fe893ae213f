"""Figures of studies, drawn from tables made by hand: every bar, point, label and text
is that of its table."""

import dataclasses
import math

import numpy as np
import pytest
from matplotlib.colors import to_hex
from picture_scenes import (
    BLUE,
    CYCLE,
    VERMILLION,
    hot_result,
    legend,
    plain_result,
    row_type,
)
from stop_scenes import stop_scene

import simbrake as sb
from simbrake import plot
from simbrake.design.layouts import LayoutRow
from simbrake.studies import (
    Calibration,
    Estimate,
    LifeHistory,
    LiningLife,
    Sensitivity,
    SensitivityTable,
    Uncertainty,
)

Statistics = row_type(Uncertainty, "statistics")
Failure = row_type(Uncertainty, "failures")
Residuals = row_type(Calibration, "residuals")
FittedRecording = row_type(Calibration, "recordings")


def bars(axes):
    """Place, begin, end and colour of horizontal bars, from below."""
    return [
        (
            round(p.get_y() + 0.5 * p.get_height(), 6),
            p.get_x(),
            p.get_x() + p.get_width(),
            to_hex(p.get_facecolor()),
        )
        for p in axes.patches
    ]


def spans(container):
    """Low and high ends of the bars of an error bar, one row for each point, along the
    axis on which they lie."""
    segments = np.asarray(container.lines[2][0].get_segments())
    along = int(np.any(segments[:, 0, 1] != segments[:, 1, 1]))
    return segments[:, :, along]


# --- sensitivities ------------------------------------------------------------------

MASS = Sensitivity(
    "load.mass", "kg", "mass", 20e3, 1e-4, 1.0, 2e3, 1.9, 2.2, tangent=0.2
)
FRICTION = Sensitivity(
    "friction", "1", "friction", 0.35, -8.0, -1.4, 0.05, 2.6, 1.5, tangent=-0.4
)
HALF = Sensitivity("speed", "rad/s", "speed", 24.0, 0.1, math.nan, 2.0, 1.5, None)


def test_tornado_has_bounds_and_derivatives():
    other = HALF._replace(low=None, high=1.5)
    table = SensitivityTable("stopping_time", "s", 2.0, (MASS, FRICTION, HALF, other))
    figure = plot.tornado(table)
    (axes,) = figure.axes
    assert bars(axes) == [
        (0, 2.0, pytest.approx(1.9), BLUE.lower()),
        (0, 2.0, pytest.approx(2.2), VERMILLION.lower()),
        (1, 2.0, pytest.approx(2.6), BLUE.lower()),
        (1, 2.0, pytest.approx(1.5), VERMILLION.lower()),
    ]
    labels = [
        (text.get_position()[1], text.get_text()) for text in axes.get_yticklabels()
    ]
    assert labels == [(0, "mass\n20 t ± 2 t"), (1, "friction\n0.35 ± 0.05")]
    across = [np.asarray(one.get_segments()) for one in axes.collections]
    np.testing.assert_allclose(
        [one[:, 0, 0] for one in across], [[1.8, 2.2], [2.4, 1.6]]
    )
    np.testing.assert_allclose(
        [one[0, :, 1] for one in across], [[-0.35, 0.35], [0.65, 1.35]]
    )
    (base,) = axes.lines
    np.testing.assert_allclose(base.get_xdata(), 2.0)
    assert len(plot.tornado(table, most=1).axes[0].get_yticks()) == 1


# --- uncertain results --------------------------------------------------------------


def uncertain(name, unit, values, code, quantiles, **more):
    few = Statistics(
        unit,
        int(np.isfinite(values).sum()),
        Estimate(0, 0, 0),
        Estimate(0, 0, 0),
        quantiles,
        0.0,
        0.0,
    )
    data = {name: np.asarray(values), "code": np.asarray(code)}
    given = {"failures": {}, "limits": {}, "runs": len(values)} | more
    return Uncertainty(
        data,
        {name: few},
        codes={},
        inputs={},
        groups=1,
        method="random",
        seed=1,
        confidence=0.9,
        **given,
    )


def test_distribution_and_limit():
    """Ten runs, of which one has no value and one has failed: shares count all runs,
    the cumulative those with it."""
    T = 273.15 + np.array(
        [10.0, 80.0, 30.0, 40.0, 20.0, 60.0, 50.0, 70.0, np.nan, 999.0]
    )
    quantiles = {
        0.05: Estimate(285.15, 283.15, 290.15),
        0.95: Estimate(350.15, 345.15, math.inf),
    }
    failed = {
        "peak_lining_temperature > 300 K": Failure(9, Estimate(0.9, 0.8, 0.95)),
        "peak_rim_temperature > 333.15 K": Failure(2, Estimate(0.2, 0.12, 0.34)),
    }
    found = uncertain(
        "peak_rim_temperature",
        "K",
        T,
        [0] * 9 + [3],
        quantiles,
        limits={"peak_rim_temperature": 333.15},
        failures=failed,
    )
    figure = plot.distribution(found, "peak_rim_temperature")
    density, cumulative = figure.axes
    edges = [p.get_x() for p in density.patches if p.get_label() != "_"] + [80.0]
    np.testing.assert_allclose(edges, np.linspace(10.0, 80.0, 6))
    # 10 20 | 30 | 40 50 | 60 | 70 80, a tenth of all runs each
    np.testing.assert_allclose(
        [p.get_height() for p in density.patches], [20.0, 10.0, 20.0, 10.0, 20.0]
    )
    stairs = next(
        line for line in cumulative.lines if line.get_drawstyle() == "steps-post"
    )
    np.testing.assert_allclose(
        stairs.get_xydata(), [[10.0 * i, 12.5 * i] for i in range(1, 9)]
    )
    marks = [one.lines[0].get_xydata()[0] for one in cumulative.containers]
    np.testing.assert_allclose(marks, [[12.0, 5.0], [77.0, 95.0]])
    np.testing.assert_allclose(spans(cumulative.containers[0]), [[10.0, 17.0]])
    assert not cumulative.containers[1].lines[2]  # its interval is not bounded
    words = "limit, exceeded with probability 0.2 [0.12, 0.34]"
    for panel in (density, cumulative):
        (limit,) = [line for line in panel.lines if line.get_label() == words]
        np.testing.assert_allclose(limit.get_xdata(), 60.0)


# --- measured data ------------------------------------------------------------------


def test_overlay_shows_data_and_run():
    run = plain_result()
    t = np.array([0.3, 0.1, 0.7])
    omega = np.array([18.0, 20.5, 12.0])
    tight = np.array([3e4, 1e4, 5e4])
    data = sb.studies.Measured.of(
        t, {"omega": omega, "tight_tension": tight}, sigma={"omega": [0.1, 0.2, 0.3]}
    )
    figure = plot.overlay(run, data)
    speed, tension = figure.axes
    for panel, values, column, factor in (
        (speed, omega, "omega", 1.0),
        (tension, tight, "tight_tension", 1e-3),
    ):
        (points,) = panel.containers
        np.testing.assert_allclose(
            points.lines[0].get_xydata(), np.stack([t, factor * values], axis=1)
        )
        line = next(line for line in panel.lines if line.get_label() == "run")
        along, drawn = line.get_data()
        assert (along[0], along[-1]) == (0.1, 0.7)
        apart = (
            np.min(
                np.abs(np.subtract.outer(along, [e.time for e in run.events])), axis=1
            )
            > 1e-9
        )
        np.testing.assert_allclose(
            drawn[apart], factor * np.asarray(getattr(run.series(along), column))[apart]
        )
    sigma = np.array([[0.1], [0.2], [0.3]])
    np.testing.assert_allclose(
        spans(speed.containers[0]), omega[:, None] + sigma * [-1, 1]
    )
    assert not tension.containers[0].lines[2]
    hot = hot_result()
    rim = plot.overlay(
        hot, sb.studies.Measured.of(t, {"rim_temperature": t + 300.0})
    ).axes[0]
    np.testing.assert_allclose(
        rim.containers[0].lines[0].get_ydata(), t + 300.0 - 273.15
    )


def test_calibration_with_single_values():
    """Temperatures in °C; an event that did not occur has no bar."""
    run = hot_result()
    t = np.array([0.2, 0.4, 0.6])
    speed = np.array([18.0, 15.0, 12.0])
    rim = np.array([300.0, 320.0, 330.0])
    sigma = np.array([0.5, 1.0, 2.0])
    events = {"stopping_time": 1.0, "full_slip_time": 0.3}
    data = sb.studies.Measured.of(
        t, {"omega": speed, "rim_temperature": rim}, events=events
    )
    one = lambda x: np.array([x])
    residuals = (
        Residuals("omega", "rad/s", t, speed, sigma, speed - 1.0, speed + 1.0),
        Residuals("rim_temperature", "K", t, rim, sigma, rim - 4.0, rim + 2.0),
        Residuals("stopping_time", "s", None, one(1.0), one(0.1), one(1.5), one(0.9)),
        Residuals(
            "full_slip_time", "s", None, one(0.3), one(0.1), one(math.inf), one(0.4)
        ),
    )
    named = {field.name: None for field in dataclasses.fields(Calibration)}
    named |= {
        "residuals": residuals,
        "recordings": (FittedRecording("", data, run.scene, run.scene),),
    }
    figure = plot.calibration(
        Calibration(**named | {"message": "converged", "chi2": 12.5, "freedom": 4})
    )
    (omega, T, was), (omega_off, T_off, now) = np.reshape(figure.axes, (2, 3))
    for panel, off, values, shift, errors in (
        (omega, omega_off, speed, 0.0, 1.0 / sigma),
        (T, T_off, rim, 273.15, 2.0 / sigma),
    ):
        (points,) = panel.containers
        np.testing.assert_allclose(
            points.lines[0].get_xydata(), np.stack([t, values - shift], axis=1)
        )
        np.testing.assert_allclose(
            spans(points), (values - shift)[:, None] + sigma[:, None] * [-1, 1]
        )
        np.testing.assert_allclose(
            off.lines[0].get_xydata(), np.stack([t, errors], axis=1)
        )
    drawn = next(line for line in T.lines if line.get_label() == "fitted")
    hottest = np.ravel(run.series(drawn.get_xdata()).rim_temperature) - 273.15
    np.testing.assert_allclose(drawn.get_ydata(), hottest, rtol=1e-6)
    heights = [[bar.get_height() for bar in panel.patches[:2]] for panel in (was, now)]
    np.testing.assert_allclose(heights, [[5.0, 0.0], [-1.0, 1.0]], atol=1e-12)


# --- layouts and wear ---------------------------------------------------------------


def test_layouts_beside_the_last_one():
    """A layout that is far from even in its targets would hide the others' differences:
    it is left out there."""
    rows = [
        LayoutRow(
            name,
            np.radians(angle),
            None,
            {"normal_load": np.asarray(load)},
            {"normal_load": "N"},
        )
        for name, angle, load in (
            ("uneven", [30.0, 30.0, 30.0], [5.0, 6.0, 8.0]),
            ("given", [40.0, 30.0, 20.0], [4.0, 4.5, 5.8]),
            ("level", [42.0, 30.0, 18.0], [5.0, 5.0, 5.0]),
        )
    ]
    for row in rows:
        row.values["slip"] = np.ones(3)
        row.units["slip"] = ""
    angles, apart, loads, _ = sb.layouts.figures.layouts(rows).axes
    np.testing.assert_allclose(
        [line.get_ydata() for line in angles.lines],
        [np.degrees(row.angle) for row in rows],
    )
    assert all(
        line.get_xdata().tolist() == [1, 2, 3] for line in [*angles.lines, *apart.lines]
    )
    np.testing.assert_allclose(
        [line.get_ydata() for line in apart.lines], [[-2, 0, 2], [0, 0, 0]], atol=1e-12
    )
    assert [line.get_color() for line in apart.lines] == list(CYCLE[1:3])
    assert [text.partition(": ")[2] for text in legend(loads)] == [
        f"maximum over minimum {ratio}" for ratio in ("1.6", "1.45", "1")
    ]
    assert [[p.get_height() for p in group] for group in loads.containers] == [
        [5, 6, 8],
        [4, 4.5, 5.8],
        [5, 5, 5],
    ]


def made_life(name_of_first, each, brakings, turned_at=()):
    """A life in which wear rises evenly; lining 1 wears at a rate of 1, the others at
    `each` of it."""
    done = np.array([0.0, 0.5, 1.0]) * brakings
    worn = 8e-3 * (done / brakings)[:, None] * np.asarray(each)
    history = LifeHistory(done, worn, worn[1:2].repeat(3, axis=0), np.ones(3))
    return LiningLife(
        brakings,
        name_of_first,
        brakings / np.asarray(each),
        8e-3 * np.ones(len(each)),
        turned_at,
        None,
        history,
        2,
    )


def test_wear_along_band_and_over_life():
    lives = {
        "as built": made_life(1, [1.0, 0.5, 0.3], 12e3),
        "turned": made_life(1, [1.0, 0.8, 0.9], 2e4, (5e3,)),
    }
    figure = plot.wear(lives)
    along, course = figure.subfigs
    first, second, bar = along.axes
    left, right = course.axes
    assert bar.get_ylim() == (0.0, 20.0)
    for panel, each in ((first, [1.0, 0.5, 0.3]), (second, [1.0, 0.8, 0.9])):
        drawn = [line for line in panel.lines if line.get_marker() == "o"]
        parts = [line.get_xydata().tolist() for line in drawn]
        np.testing.assert_allclose(
            parts,
            [
                [[i + 1, 8.0 * k / 5 * x] for i, x in enumerate(each)]
                for k in range(1, 6)
            ],
            rtol=1e-12,
        )
        (limit,) = [p for p in panel.patches if p.get_label() == "permissible"]
        np.testing.assert_allclose(limit.get_data().values, 8.0)
        np.testing.assert_allclose(limit.get_data().edges, [0.5, 1.5, 2.5, 3.5])
    most = {
        line.get_label(): line.get_xydata()[-1].tolist()
        for line in left.lines
        if len(line.get_xdata()) > 2
    }
    np.testing.assert_allclose(
        [most["as built"], most["turned"]], [[12.0, 8.0], [20.0, 8.0]]
    )
    least = [
        line.get_xydata()[-1]
        for line in left.lines
        if line.get_linestyle() == "--" and len(line.get_xdata()) > 2
    ]
    np.testing.assert_allclose(least, [[12.0, 2.4], [20.0, 6.4]])
    uneven = [line.get_xydata() for line in right.lines if len(line.get_xdata()) > 2]
    np.testing.assert_allclose(uneven[0][:, 1], 1.0 / 0.6)
    np.testing.assert_allclose(uneven[1][:, 1], 1.0 / 0.9)
    np.testing.assert_allclose([one[-1, 0] for one in uneven], [12.0, 20.0])
    for panel in (left, right):
        (turn,) = [line for line in panel.lines if line.get_linestyle() == ":"]
        np.testing.assert_allclose(turn.get_xdata(), 5.0)


def test_angles_add_up_to_the_wrap():
    layout = sb.layouts.equal_increment_angles(0.3, 10, 10, math.radians(270.0))
    axes = sb.layouts.figures.angles(
        {"equal increments": layout, "with gaps": plain_result().scene}
    ).axes[0]
    steps = [line for line in axes.lines if line.get_marker() == "None"]
    dots = {
        line.get_label().partition(":")[0]: line
        for line in axes.lines
        if line.get_marker() != "None"
    }
    np.testing.assert_allclose(
        dots["equal increments"].get_ydata(), np.degrees(layout.angle), rtol=1e-12
    )
    np.testing.assert_allclose(dots["uniform pitch"].get_ydata(), 27.0, rtol=1e-12)
    x = np.asarray(steps[0].get_xdata()).reshape(10, 3)
    np.testing.assert_allclose(x[:, 1] - x[:, 0], np.degrees(layout.angle), rtol=1e-12)
    assert x[-1, 1] == pytest.approx(270.0)
    x = np.asarray(steps[1].get_xdata()).reshape(8, 3)
    np.testing.assert_allclose(x[1:, 0] - x[:-1, 1], [2, 2, 2, 6, 2, 2, 2], rtol=1e-9)
    assert axes.get_xlabel().endswith(", °")
    assert axes.get_ylabel().endswith(", °")
    assert r"$\Sigma\beta$ = 270°" in axes.get_legend().get_texts()[0].get_text()
    # Z, table 6: first row
    assert dots["equal increments"].get_ydata()[0] == pytest.approx(50.3, abs=0.5)


def test_angles_name_every_fault():
    with pytest.raises(sb.InputError) as caught:
        sb.layouts.figures.angles(
            {
                "degrees": np.full(10, 27.0),
                "none": [],
                "words": "wide",
                "fine": np.full(4, 0.5),
            }
        )
    assert [fault.path for fault in caught.value.faults] == [
        "given['degrees']",
        "given['none']",
        "given['words']",
    ]
    assert "are they in degrees" in str(caught.value)
    with pytest.raises(sb.InputError, match="empty"):
        sb.layouts.figures.angles({})


# --- materials ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def table():
    """At 200 kJ all pairs are within their limits, at 4 MJ none."""
    track = sb.formulas.EstimateData(track_area=1.6)
    names = ["steel_20L", "brass"], ["FK-24A", "retinax"]
    return sb.compare_materials(
        stop_scene(), *names, energy=[2e5, 4e6], data=track, run=False
    )


def test_panels_and_bars_of_materials(table):
    """A line of panels for each lining; a bar for each rim and level."""
    panels = np.reshape(sb.formulas.figures.materials(table).axes, (2, 4))
    kinds = (
        ("surface", lambda x: x - 273.15),
        ("stress_ratio", lambda x: x),
        ("wear", lambda x: 1e6 * x),
    )
    for line, lining in zip(panels, ("FK-24A", "retinax"), strict=True):
        rows = [
            table.row(rim, lining, level)
            for rim in ("steel_20L", "brass")
            for level in (0, 1)
        ]
        for axes, (name, shown) in zip(line, kinds, strict=False):
            np.testing.assert_allclose(
                [bar.get_width() for bar in axes.patches],
                [shown(row[name].value) for row in rows],
            )
        mass = [bar.get_width() for bar in line[3].patches]
        np.testing.assert_allclose(mass, [row["mass"].value for row in rows[1::2]])
