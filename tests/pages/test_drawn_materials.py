"""The chart of materials: bars, limits, hatches and words."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from picture_scenes import BLUE
from stop_scenes import stop_scene

import simbrake as sb
from simbrake import plot


def legend(drawn):
    return [text.get_text() for text in drawn.get_texts()]


@pytest.fixture(scope="module")
def table():
    """At 200 kJ all pairs are within their limits, at 4 MJ none."""
    track = sb.formulas.EstimateData(track_area=1.6)
    names = ["steel_20L", "brass"], ["FK-24A", "retinax"]
    return sb.compare_materials(stop_scene(), *names, energy=[2e5, 4e6], data=track, run=False)


def test_panels_and_bars_of_materials(table):
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
            np.testing.assert_allclose([bar.get_facecolor()[:3] for bar in bars], [pale, full] * 2)
        mass = line[3].patches
        np.testing.assert_allclose([bar.get_width() for bar in mass], [row["mass"].value for row in rows[1::2]])
        np.testing.assert_allclose([bar.get_y() + 0.5 * bar.get_height() for bar in mass], [0.0, 1.0], atol=1e-12)
        np.testing.assert_allclose([bar.get_facecolor()[:3] for bar in mass], 0.6)
        kelvin = [
            min(rim.permissible, pad.permissible) for pad in table.linings if pad.name == lining for rim in table.rims
        ]
        for axes, limits in ((line[0], np.asarray(kelvin) - 273.15), (line[1], [1.0, 1.0])):
            drawn = [one.get_xydata() for one in axes.lines]
            np.testing.assert_allclose(drawn, [[[x, i - 0.45], [x, i + 0.45]] for i, x in enumerate(limits)])
        assert not line[2].lines
        assert not line[3].lines
        assert [axes.get_title(loc="left") for axes in line] == [f"lining {lining}", "", "", ""]
        assert all(axes.get_ylim() == (1.6, -0.6) for axes in line)
    assert legend(figure.legends[0]) == [
        *(f"{level.words}  ({level.label})" for level in table.levels),
        "permissible, rim or lining",
        "limit exceeded",
    ]
    colours = [patch.get_facecolor()[:3] for patch in figure.legends[0].get_patches()[:2]]
    np.testing.assert_allclose(colours, [pale, full])


def test_chart_of_what_is_within_limits(table):
    """Nothing is hatched, and the legend has no word for it; the wear of one level spreads little."""
    track = sb.formulas.EstimateData(track_area=1.6)
    weak = sb.compare_materials(stop_scene(), ["steel_20L"], ["FK-24A"], energy=[2e5], data=track, run=False)
    figure = plot.materials(weak)
    assert figure.axes[2].get_xscale() == "linear"
    # of strong and weak ones the axis begins at the decade of the least wear
    wide = sb.compare_materials(stop_scene(), ["steel_20L"], ["FK-24A"], energy=[2e4, 8e6], data=track, run=False)
    axes = plot.materials(wide).axes[2]
    least = 1e6 * min(row["wear"].value for row in wide)
    assert axes.get_xscale() == "log"
    assert axes.get_xlim()[0] <= least < 10 * axes.get_xlim()[0]
    assert np.log10(axes.get_xlim()[0]) == pytest.approx(round(np.log10(axes.get_xlim()[0])))
