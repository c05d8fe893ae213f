"""The chart of materials and that of work and precision: bars, limits, hatches, curves and words."""

import json

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from stop_scenes import stop_scene

import simbrake as sb
from simbrake import plot
from simbrake.plot._shared import BLUE


def legend(drawn):
    return [text.get_text() for text in drawn.get_texts()]


@pytest.fixture(scope="module")
def table():
    """At 200 kJ all pairs are within their limits, at 4 MJ none."""
    track = sb.formulas.EstimateData(track_area=1.6)
    names = ["steel_20L", "brass"], ["FK-24A", "retinax"]
    return sb.compare_materials(stop_scene(), *names, energy=[2e5, 4e6], data=track, run=False)


def test_a_row_of_panels_for_each_lining_and_a_bar_for_each_level(table):
    figure = plot.materials(table)
    panels = np.reshape(figure.axes, (2, 4))
    kinds = (
        ("surface", lambda x: x - 273.15, "maximum surface\ntemperature, °C"),
        ("stress_ratio", lambda x: x, "thermal stress\nover allowable (–)"),
        ("wear", lambda x: 1e6 * x, "wear of the linings,\nµm"),
    )
    assert {row.admissible for row in table if row.level == 0} == {True}
    assert {row.admissible for row in table if row.level == 1} == {False}
    pale, full = 0.375 + 0.625 * np.asarray(to_rgb(BLUE)), np.asarray(to_rgb(BLUE))
    for line, lining in zip(panels, ("FK-24A", "retinax"), strict=True):
        for axes, (name, shown, _) in zip(line, kinds, strict=False):
            bars = axes.patches
            rows = [table.row(rim, lining, level) for rim in ("steel_20L", "brass") for level in (0, 1)]
            np.testing.assert_allclose([bar.get_width() for bar in bars], [shown(row[name].value) for row in rows])
            middles = [bar.get_y() + 0.5 * bar.get_height() for bar in bars]
            np.testing.assert_allclose(middles, [-0.2, 0.2, 0.8, 1.2])
            assert all(0.3 < bar.get_height() < 0.4 for bar in bars)
            assert [bar.get_hatch() for bar in bars] == [None, "////"] * 2
            np.testing.assert_allclose([bar.get_facecolor()[:3] for bar in bars], [pale, full] * 2)
        mass = line[3].patches
        np.testing.assert_allclose([bar.get_width() for bar in mass], [row["mass"].value for row in rows[1::2]])
        np.testing.assert_allclose([bar.get_y() + 0.5 * bar.get_height() for bar in mass], [0.0, 1.0], atol=1e-12)
        assert {bar.get_hatch() for bar in mass} == {None}
        np.testing.assert_allclose([bar.get_facecolor()[:3] for bar in mass], 0.6)
        kelvin = [
            min(rim.permissible, pad.permissible) for pad in table.linings if pad.name == lining for rim in table.rims
        ]
        for axes, limits in ((line[0], np.asarray(kelvin) - 273.15), (line[1], [1.0, 1.0])):
            drawn = [one.get_xydata() for one in axes.lines]
            np.testing.assert_allclose(drawn, [[[x, i - 0.45], [x, i + 0.45]] for i, x in enumerate(limits)])
        assert not line[2].lines
        assert not line[3].lines
        assert [text.get_text() for text in line[0].get_yticklabels()] == ["steel 20L", "brass"]
        assert {text.get_text() for axes in line[1:] for text in axes.get_yticklabels()} == {""}
        assert [axes.get_title(loc="left") for axes in line] == [f"lining {lining}", "", "", ""]
        assert all(axes.get_ylim() == (1.6, -0.6) for axes in line)
    titles = [*(title for _, _, title in kinds), "mass of the rim, kg\n(all levels)"]
    assert [axes.get_xlabel() for axes in panels[1]] == titles
    assert {axes.get_xlabel() for axes in panels[0]} == {""}
    assert legend(figure.legends[0]) == [
        *(f"{level.words}  ({level.label})" for level in table.levels),
        "permissible, rim or lining",
        "limit exceeded",
    ]
    colours = [patch.get_facecolor()[:3] for patch in figure.legends[0].get_patches()[:2]]
    np.testing.assert_allclose(colours, [pale, full])


def test_the_chart_of_what_is_within_its_limits(table):
    """Nothing is hatched, and the legend has no word for it; the wear of one level spreads little."""
    track = sb.formulas.EstimateData(track_area=1.6)
    weak = sb.compare_materials(stop_scene(), ["steel_20L"], ["FK-24A"], energy=[2e5], data=track, run=False)
    figure = plot.materials(weak)
    assert legend(figure.legends[0])[1:] == ["permissible, rim or lining"]
    assert not any(bar.get_hatch() for axes in figure.axes for bar in axes.patches)
    assert figure.axes[2].get_xscale() == "linear"
    heights = [one.get_size_inches()[1] for one in (figure, plot.materials(table))]
    assert heights[0] < heights[1]
    # of strong and weak ones the axis begins at the decade of the least wear
    wide = sb.compare_materials(stop_scene(), ["steel_20L"], ["FK-24A"], energy=[2e4, 8e6], data=track, run=False)
    axes = plot.materials(wide).axes[2]
    least = 1e6 * min(row["wear"].value for row in wide)
    assert axes.get_xscale() == "log"
    assert axes.get_xlim()[0] <= least < 10 * axes.get_xlim()[0]
    assert np.log10(axes.get_xlim()[0]) == pytest.approx(round(np.log10(axes.get_xlim()[0])))


# --- work and precision -----------------------------------------------------------------------------------------------


def benchmark(**more):
    rows = [
        {"method": method, "seconds": 1e-3 * (k + 1), "error": error}
        for k, method in enumerate(["simbrake Dopri8", "SciPy LSODA", "SciPy Radau", "unknown"])
        for error in (1e-6, 0.0)
    ]
    return {"scenes": {"a": {"name": "a", "title": "stop", "reference": {"uncertainty": 1e-14}, "rows": rows}}} | more


def test_methods_of_a_family_share_their_colour_and_differ_by_marks():
    figure = plot.work_precision(benchmark(machine={"cpu": "a cpu", "cores": 3, "versions": {"simbrake": "9.1"}}))
    (axes,) = figure.axes
    lines = {line.get_label(): line for line in axes.lines}
    assert list(lines) == ["simbrake Dopri8", "SciPy LSODA", "SciPy Radau", "unknown"]
    for k, line in enumerate(lines.values()):
        np.testing.assert_allclose(line.get_xydata(), [[k + 1.0, 1e-6], [k + 1.0, 1e-16]])
    own, one, two, other = lines.values()
    assert one.get_color() == two.get_color() == BLUE
    assert (own.get_color(), other.get_color()) == ("black", "0.5")
    assert own.get_marker() == one.get_marker() == other.get_marker() != two.get_marker()
    assert own.get_linewidth() > one.get_linewidth()
    assert axes.get_title(loc="left") == "(a) stop"
    assert axes.get_xscale() == axes.get_yscale() == "log"
    (shade,) = axes.patches
    box = shade.get_extents().transformed(axes.transData.inverted())
    np.testing.assert_allclose([box.y0, box.y1], [1e-16, 1e-14])
    assert legend(axes.get_legend())[-1] == "reference uncertain"
    head, place = figure.get_suptitle().splitlines()
    assert head.endswith("left and low is better")
    assert place == "a cpu, 3 cores; simbrake 9.1"
    assert plot.work_precision(benchmark()).get_suptitle().endswith("machine unknown, ? cores; simbrake ")


def test_a_benchmark_lacks_what_it_lacks(tmp_path):
    whole = benchmark()["scenes"]["a"]
    for scene, names in (
        ([], "name title reference rows"),
        ({**whole, "reference": {}}, "reference.uncertainty"),
        ({**whole, "rows": [{"method": "a"}]}, "rows.seconds rows.error"),
        ({"name": "a", "rows": []}, "title reference"),
    ):
        with pytest.raises(sb.InputError) as caught:
            plot.work_precision({"scenes": {"s": scene}})
        assert [fault.path for fault in caught.value.faults] == [f"data.scenes.s.{name}" for name in names.split()]
    for wrong in ([], {}, {"scenes": []}, {"scenes": {}}, {"scenes": None}):
        file = tmp_path / "found.json"
        file.write_text(json.dumps(wrong), "utf-8")
        with pytest.raises(sb.InputError, match="is missing or empty"):
            plot.work_precision(file)
