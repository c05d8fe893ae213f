"""Pictures show what the run has: read back from what is drawn, in the units that the
axes name."""

import dataclasses
import itertools
import math
import pathlib
import re

import jax
import numpy as np
import pytest
from matplotlib.colors import to_hex
from picture_scenes import (
    CONTACTS,
    hot_result,
    plain_result,
    radius,
    scale,
    staged_result,
    wedges,
)
from stop_scenes import closed_form, stop_scene

import simbrake as sb
from simbrake import plot


@pytest.fixture(scope="module")
def plain():
    return plain_result()


@pytest.fixture(scope="module")
def staged():
    return staged_result()


@pytest.fixture(scope="module")
def hot():
    return hot_result()


@pytest.mark.parametrize("name", ["plain", "staged", "hot"])
def test_pulley_shows_tensions_and_loads(name, request):
    result = request.getfixturevalue(name)
    time = 0.5 * float(result.stopping_time)
    axes = plot.pulley(result, time).axes[0]
    s = result.series([time])
    n = s.tension.shape[1]
    tension = np.append(s.slack_tension, s.tension[0]) / 1e3
    (line,) = [x for x in axes.lines if x.get_gid() == "tension"]
    drawn = scale(axes, "tension scale")(radius(line.get_xydata())).reshape(n, 2)
    np.testing.assert_allclose(
        drawn, np.stack([tension[:-1], tension[1:]], axis=1), rtol=1e-9
    )
    bars = wedges(axes, "load")
    loads = scale(axes, "load scale")([bar.r - bar.width for bar in bars])
    np.testing.assert_allclose(loads, np.asarray(s.normal_load)[0] / 1e3, rtol=1e-9)
    for gid, values in (("T", tension), ("N", s.normal_load[0] / 1e3)):
        written = [float(t.get_text()) for t in axes.texts if t.get_gid() == gid]
        np.testing.assert_allclose(written, values, rtol=6e-3)


def test_linings_lie_at_their_true_angles(plain):
    axes = plot.pulley(plain).axes[0]
    drawn = wedges(axes, "external")
    span = np.asarray([[w.theta2, w.theta1] for w in drawn])
    np.testing.assert_allclose(span[:, 0] - span[:, 1], 30.0, rtol=1e-12)
    gaps = np.full(7, 2.0)
    gaps[3] = 6.0
    np.testing.assert_allclose(span[:-1, 1] - span[1:, 0], gaps, rtol=1e-9)
    assert span[0, 0] + span[-1, 1] == pytest.approx(
        180.0
    )  # the wrap is centred on the top
    # slack end at the left, where the pulley that turns counter-clockwise runs off
    assert span[0, 0] > 90 > span[-1, 1]


def test_linings_have_the_colour_of_contact(plain, staged):
    onset = float(plain.slip_onset_time)
    full = float(plain.full_slip_time)
    colours = {to_hex(colour): kind for kind, colour in CONTACTS.items()}

    def seen(result, time, pair="external"):
        return [
            colours[to_hex(w.get_facecolor())]
            for w in wedges(plot.pulley(result, time).axes[0], pair)
        ]

    middle = 0.5 * (onset + full)
    k = int(plain.series([middle]).at_limit[0])
    assert 0 < k < 8
    assert seen(plain, middle) == ["at its friction limit"] * k + ["sticks"] * (8 - k)
    assert seen(plain, 0.5 * float(plain.stopping_time)) == ["slides"] * 8
    late = 0.5 * (float(staged.external_lock_time) + float(staged.stopping_time))
    assert seen(staged, late, "internal") == ["slides"] * 6
    assert "slides" not in seen(staged, late)
    early = 0.5 * float(staged.internal_slip_time)
    assert seen(staged, early, "internal") == ["sticks"] * 6
    assert seen(staged, early) == ["slides"] * 6


def test_pulley_refuses_what_it_cannot_draw(plain):
    for time in (99.0, math.nan):
        with pytest.raises(sb.InputError):
            plot.pulley(plain, time)
    batch = jax.tree.map(lambda x: np.stack([x, x]), plain)
    for draw in (plot.pulley, plot.lining_map, plot.depth):
        with pytest.raises(sb.InputError, match="batch of runs"):
            draw(batch)


def test_chain_is_drawn_lining_by_lining():
    scene = stop_scene(n=4, beta=60.0, C=1e5, T0=2e3, w0=6.0, elongation=2e-2, end=0.05)
    linings = dataclasses.replace(scene.brake.linings, mass=4.0)
    band = sb.Band(scene.brake.band.radius, 1e5, sb.Segments(2e7))
    result = sb.simulate(
        dataclasses.replace(
            scene, brake=dataclasses.replace(scene.brake, band=band, linings=linings)
        )
    )
    slips = {e.lining: e.time for e in result.events if e.name == "lining_slip"}
    # the front of slip runs from the tight end to the slack end
    time = 0.5 * (slips[4] + slips[3])
    drawn = wedges(plot.pulley(result, time).axes[0], "external")
    seen = [to_hex(w.get_facecolor()) for w in drawn]
    sticks, slides = (to_hex(CONTACTS[c]) for c in ("sticks", "slides"))
    assert seen == [sticks] * 3 + [slides]
    # stick and slip over time: each lining sticks to the moment at which it slides,
    # whole and enlarged
    for panel in plot.contacts(result).axes:
        edges, linings, states = mesh_of(panel)
        np.testing.assert_allclose(linings, np.arange(5) + 0.5)
        middle = 0.5 * (edges[1:] + edges[:-1])
        early = middle < slips[1]
        ahead = np.array([[t > slips[k] for t in middle[early]] for k in (1, 2, 3, 4)])
        np.testing.assert_array_equal(states[:, early], ahead)
        assert (edges[0], edges[-1]) == (0.0, pytest.approx(0.05))
    figure = plot.lining_map(result, "displacement")
    mesh = figure.axes[0].collections[0]
    edges = mesh.get_coordinates()[0, :, 0]
    shown = np.asarray(mesh.get_array()).reshape(4, -1)
    truth = (
        np.asarray(result.series(0.5 * (edges[1:] + edges[:-1])).displacement).T * 1e3
    )
    np.testing.assert_allclose(shown, truth, atol=1e-12)


# --- maps ---------------------------------------------------------------------------


def mesh_of(axes):
    """Edges of the cells and values of a map, one row for each place."""
    mesh = axes.collections[0]
    corners = np.asarray(mesh.get_coordinates())
    return (
        corners[0, :, 0],
        corners[:, 0, 1],
        np.asarray(mesh.get_array()).reshape(corners.shape[0] - 1, -1),
    )


@pytest.mark.parametrize(
    ("quantity", "factor", "shift"),
    [
        ("normal_load", 1e-3, 0.0),
        ("temperature", 1.0, -273.15),
        ("slip_speed", 1.0, 0.0),
    ],
)
def test_lining_map_shows_the_series(hot, quantity, factor, shift):
    figure = plot.lining_map(hot, quantity)
    edges, _, shown = mesh_of(figure.axes[0])
    s = hot.series(0.5 * (edges[1:] + edges[:-1]))
    column = {"temperature": "lining_temperature"}.get(quantity, quantity)
    truth = np.asarray(getattr(s, column))
    truth = np.broadcast_to(truth if truth.ndim == 2 else truth[:, None], shown.T.shape)
    np.testing.assert_allclose(
        shown, factor * np.abs(truth.T) + shift, rtol=1e-9, atol=1e-9
    )
    # every event is an edge: no cell mixes what is before and after it
    inside = [e.time for e in hot.events if edges[0] <= e.time <= edges[-1]]
    assert np.max(np.min(np.abs(np.subtract.outer(inside, edges)), axis=1)) <= 1e-11


@pytest.mark.parametrize("pair", ["external", "internal"])
def test_friction_heat_of_a_map_adds_up(staged, pair):
    _, _, shown = mesh_of(plot.lining_map(staged, "friction_heat", pair=pair).axes[0])
    np.testing.assert_allclose(
        shown[:, -1] * 1e3, sb.results.friction_work(staged, pair=pair), rtol=1e-4
    )
    assert np.all(np.diff(shown, axis=1) >= 0)


def test_depth_shows_the_layers(hot):
    figure = plot.depth(hot)
    field, profile = figure.axes[:2]
    edges, layers, shown = mesh_of(field)
    rim = hot.scene.heat.bodies[0]
    np.testing.assert_allclose(np.diff(layers), 1e3 * np.asarray(rim.steps), rtol=1e-9)
    nodes = [i for i, name in enumerate(hot.nodes) if name.startswith("rim")]
    truth = (
        np.asarray(hot.series(0.5 * (edges[1:] + edges[:-1])).temperature)[:, nodes].T
        - 273.15
    )
    np.testing.assert_allclose(shown, truth, rtol=1e-12)
    # the hottest profile is among those at the side
    hottest = shown[:, np.argmax(shown[0])]
    assert any(np.array_equal(line.get_xdata(), hottest) for line in profile.lines)


# --- those that were there ----------------------------------------------------------


def test_example_of_the_page(tmp_path, monkeypatch):
    page = (pathlib.Path(__file__).parents[2] / "docs" / "pictures.md").read_text(
        "utf-8"
    )
    example = re.findall(r"```python\n(.*?)```", page, re.S)[0]
    monkeypatch.chdir(tmp_path)
    found = {}
    exec(compile(example, "pictures.md", "exec"), found)
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "pulley.png",
        "stop.gif",
        "stop.png",
    ]
    axes = plot.stop(found["result"]).axes
    lines = sorted(
        {line.get_xdata()[0] for line in axes[0].lines if len(line.get_xdata()) == 2}
    )
    truth = closed_form()
    np.testing.assert_allclose(
        lines, [truth["t0"], truth["t1"], truth["stop"]], rtol=1e-9
    )
    # each curve at the ends of its pieces: taken along, sliding, held
    T_0 = 8.0
    T_n = 8.0 * truth["Pi"]
    R = 0.725
    taken, sliding, held = (
        0.5 * (a + b)
        for a, b in itertools.pairwise([truth["t0"], truth["t1"], truth["stop"], 5.0])
    )
    x = math.sqrt(2e5 * R**2 / 800.0) * (taken - truth["t0"])  # χ(t − t_0)
    rising = T_0 + 2e5 * R * 20.0 * math.sin(x) / math.sqrt(2e5 * R**2 / 800.0) / 1e3
    slowed = R * (T_n - T_0) * 1e3 / 800.0 * (truth["stop"] - sliding)
    at_limit = sum(limit <= taken for limit in truth["limits"])
    for curve, wanted in {
        (0, 0): (20.0 * math.cos(x), slowed),
        (2, 0): (R * (rising - T_0), R * (T_n - T_0), 0.0),
        (2, 1): (0.0, 0.0, 0.0),
        (4, 0): (rising, T_n),
        (4, 1): (T_0, T_0, T_0),
        (6, 0): (at_limit, 20),
    }.items():
        t, y = axes[curve[0]].lines[curve[1]].get_data()
        at = (taken, sliding, held)[: len(wanted)]
        stairs = [y[np.searchsorted(t, time, side="right") - 1] for time in at]
        drawn = stairs if curve[0] == 6 else np.interp(at, t, y)
        np.testing.assert_allclose(
            drawn, wanted, rtol=2e-4, atol=1e-9, err_msg=str(curve)
        )


def test_page_names_every_picture():
    page = (pathlib.Path(__file__).parents[2] / "docs" / "pictures.md").read_text(
        "utf-8"
    )
    assert {name for name in plot.__all__ if f"plot.{name}(" not in page} == set()


def curves(axes):
    return {
        line.get_label(): line.get_xydata()
        for line in axes.lines
        if not line.get_label().startswith("_")
    }


def test_duty_shows_lever_and_load(staged):
    """The lever rises from 1 to 15 kN in half a second; a mass of 30 t on the hook
    pulls with `m g r`."""
    lever, load = plot.duty(staged).axes
    ((_, drawn),) = curves(lever).items()
    np.testing.assert_allclose(
        drawn[:, 1], np.minimum(1.0 + 28.0 * drawn[:, 0], 15.0), rtol=1e-9
    )
    np.testing.assert_array_equal(load.lines[0].get_ydata(), 0.0)
    string = sb.TrippingLoad(
        8e3, 60e3, 5e3, 0.2, 8.0, 10.0, drum_radius=0.4, line_count=8, count=2, drag=1e3
    )
    b = sb.Brake(
        sb.Pulley(0.59, 1200.0), sb.Band(0.623), sb.uniform_linings(4, 4.5, 0.35)
    )
    run = sb.simulate(sb.Scene(b, sb.Duty(0.0, string), sb.Initial(3.0), 1.0))
    figure = plot.duty(run)
    (t, torque), (_, mass) = (panel.lines[0].get_data() for panel in figure.axes[1:])
    on_hook = np.where(t < 0.2, 8e3, 68e3)
    apart = np.abs(t - 0.2) > 1e-9
    np.testing.assert_allclose(mass[apart], on_hook[apart] / 1e3, rtol=1e-9)
    wanted = on_hook * 9.80665 * 0.05 - 1e3 * np.asarray(run.series(t).omega)
    np.testing.assert_allclose(torque[apart], wanted[apart] / 1e3, rtol=1e-9)


def test_stages_show_the_run(staged):
    figure = plot.stages(staged)
    speed, torque, heat, *overlaps = figure.axes
    t = curves(speed)[r"pulley $\omega$"][:, 0]
    s = staged.series(t)
    o = sb.results.overlap(staged, t)
    apart = (
        np.min(np.abs(np.subtract.outer(t, [e.time for e in staged.events])), axis=1)
        > 1e-9
    )
    outer = s.pairs["external"]
    inner = s.pairs["internal"]
    for panel, label, values in (
        (speed, r"pulley $\omega$", s.omega),
        (speed, r"bandage $\omega_b$", s.bandage_speed),
        (torque, r"band on bandage $M_\mathrm{ext}$", outer.torque / 1e3),
        (torque, r"pulley on bandage $\Lambda$", inner.torque / 1e3),
        (torque, r"it sticks up to $M_\mathrm{int}$", inner.capacity / 1e3),
        (heat, "external pair", outer.heat / 1e3),
        (heat, "internal pair", inner.heat / 1e3),
    ):
        drawn = curves(panel)[label]
        np.testing.assert_array_equal(drawn[:, 0], t)
        np.testing.assert_allclose(
            drawn[apart, 1], np.asarray(values)[apart], rtol=1e-9, err_msg=label
        )
    for panel, fields in zip(
        overlaps,
        [
            ("external_dynamic", "external_static"),
            ("internal_dynamic", "internal_static"),
        ],
        strict=True,
    ):
        for area, name in zip(panel.collections, fields, strict=True):
            corners = area.get_paths()[
                0
            ].vertices  # (t, value) forwards and (t, 0) back
            assert corners[:, 1].max() == pytest.approx(
                np.max(getattr(o, name)[apart]), rel=1e-9
            )
            at = corners[np.argmax(corners[:, 1]), 0]
            assert float(
                getattr(sb.results.overlap(staged, [at]), name)[0]
            ) == pytest.approx(corners[:, 1].max())
    ends = np.unique([s.start for s in staged.stages if s.name.startswith("stage_")])
    assert (
        len([t for t in speed.texts if t.get_text().startswith("stage ")])
        == len(ends)
        == 3
    )


def test_temperatures_show_the_run(hot):
    surface, friction, *depths = plot.temperatures(hot).axes
    drawn = curves(surface)
    t = drawn["rim"][:, 0]
    s = hot.series(t)
    each = np.asarray(s.lining_temperature) - 273.15
    np.testing.assert_allclose(
        drawn["rim"][:, 1], np.ravel(s.rim_temperature) - 273.15, rtol=1e-12
    )
    np.testing.assert_allclose(
        drawn["linings, hottest"][:, 1], each.max(axis=1), rtol=1e-12
    )
    np.testing.assert_allclose(
        drawn["linings, coolest"][:, 1], each.min(axis=1), rtol=1e-12
    )
    np.testing.assert_allclose(curves(friction)["when sliding"][:, 1], 0.35, rtol=1e-12)
    # through the walls at the time of the hottest rim
    top = hot.metrics["peak_rim_temperature_time"]
    T = np.asarray(hot.series([top]).temperature)[0] - 273.15
    for panel, wall, name in zip(
        depths, hot.scene.heat.walls, ("rim", "lining"), strict=True
    ):
        nodes = [i for i, node in enumerate(hot.nodes) if node.startswith(f"{name}[")]
        for line, values in zip(
            panel.lines, T[nodes].reshape(-1, wall.layers), strict=True
        ):
            steps = 1e3 * np.asarray(wall.steps)
            np.testing.assert_allclose(
                line.get_xdata(), np.cumsum(steps) - 0.5 * steps, rtol=1e-12
            )
            np.testing.assert_allclose(line.get_ydata(), values, rtol=1e-9)
