"""Results for other programs: workbooks and MATLAB files, read back by openpyxl and SciPy, beside the result itself."""

import dataclasses
import sys

import numpy as np
import openpyxl
import pytest
from result_scenes import heated_stop
from scipy.io import loadmat

import simbrake as sb

#: a name that a spreadsheet would compute, with a character that it cannot hold, and what stays of it
NASTY, KEPT = "=1+1\x01", "=1+1?"


@pytest.fixture(scope="module")
def result():
    scene = heated_stop()
    rim, cover, lining, air = scene.heat.bodies
    rim = dataclasses.replace(rim, material=sb.material("steel_20L"))
    links = (*scene.heat.links[:2], sb.thermal.Conductance(NASTY, "air", 1.0))
    bodies = (rim, dataclasses.replace(cover, name=NASTY), lining, air)
    return sb.simulate(dataclasses.replace(scene, heat=dataclasses.replace(scene.heat, bodies=bodies, links=links)))


@pytest.fixture(scope="module")
def book(result, tmp_path_factory):
    path = sb.save(result, tmp_path_factory.mktemp("book") / "run.xlsx")
    book = openpyxl.load_workbook(path)
    return {sheet.title: [list(row) for row in sheet.iter_rows()] for sheet in book}


def column(sheet, head):
    names = [cell.value for cell in sheet[0]]
    return [row[names.index(head)].value for row in sheet[1:]]


def by_name(sheet):
    return {row[0].value: [cell.value for cell in row[1:]] for row in sheet[1:]}


def test_workbook_has_numbers_of_the_result(book, result):
    """Excel's files hold 16 digits."""
    assert list(book) == ["inputs", "stops", "events", "series", "metrics", "places", "materials", "columns"]
    t, side = np.asarray(column(book["series"], "time [s]")), np.asarray(column(book["series"], "side"))
    once = side >= 0
    series = result.series(t[once])
    for name, unit, values in (
        ("omega", "rad/s", series.omega),
        ("slack_tension", "N", series.slack_tension),
        ("friction_heat", "J", series.friction_heat),
        ("tension_2", "N", series.tension[:, 1]),
        (f"temperature_{KEPT}", "K", series.temperature[:, result.nodes.index(NASTY)]),
    ):
        found = np.asarray(column(book["series"], f"{name} [{unit}]"), float)
        size = np.max(np.abs(values))  # times are rounded as well
        np.testing.assert_allclose(found[once], values, rtol=0, atol=1e-14 * size, err_msg=name)
    np.testing.assert_array_equal(column(book["events"], "event_name"), [e.name for e in result.events])
    np.testing.assert_allclose(column(book["events"], "event_time [s]"), [e.time for e in result.events], rtol=2e-15)
    np.testing.assert_allclose(column(book["stops"], "stop_time [s]"), result.stops["time"], rtol=2e-15)
    metrics = by_name(book["metrics"])
    for name in result.metrics.keys() - result.energy.keys():  # heats are among the energies
        value = result.metrics[name]
        there, unit, meaning = metrics[name]
        assert there == ("inf" if value is None else pytest.approx(value, rel=2e-15))
        assert unit
        assert len(meaning) > 4
    assert metrics["energy.friction_heat"][:2] == [pytest.approx(result.energy["friction_heat"], rel=2e-15), "J"]
    numbers = by_name(book["inputs"])
    for leaf in sb.files.leaves(result.scene):
        if np.ndim(leaf.value) == 0:
            assert numbers[leaf.path] == [pytest.approx(float(leaf.value), rel=2e-15), leaf.about.unit]
    assert numbers["brake.linings.angle[1]"][0] == pytest.approx(float(result.scene.brake.linings.angle[1]), rel=2e-15)
    (rim, lining) = book["materials"][1:]
    assert [cell.value for cell in rim][:3] == ["heat.bodies[0].material", "steel_20L", 47.8]
    assert [cell.value for cell in lining][:3] == ["heat.bodies[2].material", None, 0.8]
    assert by_name(book["columns"])["tight_tension"][:2] == ["series", "N"]


def test_no_cell_is_a_formula(book):
    cells = [cell for sheet in book.values() for row in sheet for cell in row if cell.value is not None]
    assert {cell.data_type for cell in cells} == {"s", "n"}
    texts = {cell.value: cell for cell in cells if cell.data_type == "s"}
    assert texts[KEPT].quotePrefix


def test_matlab_has_numbers_of_the_result(result, tmp_path):
    path = sb.save(result, tmp_path / "run.mat")
    read = loadmat(path, struct_as_record=False, squeeze_me=True, chars_as_strings=True)["result"]
    once = read.series.side >= 0
    series = result.series(read.series.time[once])
    for name in ("omega", "phi", "brake_torque", "tension", "temperature", "rim_layer_temperature"):
        wanted = series.temperature[:, :3] if name.startswith("rim") else getattr(series, name)
        np.testing.assert_array_equal(getattr(read.series, name)[once], wanted, err_msg=name)
    np.testing.assert_array_equal(read.events.event_name, [e.name for e in result.events])
    np.testing.assert_array_equal(read.events.event_time, [e.time for e in result.events])
    for name in result.metrics.keys() - result.energy.keys():
        value = result.metrics[name]
        assert getattr(read.metrics, name) == (np.inf if value is None else value)
    assert read.metrics.energy_friction_heat == result.energy["friction_heat"]
    assert read.metrics.status == result.status
    assert (read.units.omega, read.units.density, read.units.energy_friction_heat) == ("rad/s", "kg/m^3", "J")
    assert read.meaning.phi == "angle of the pulley since the start"
    inputs = dict(zip(read.inputs.path, read.inputs.value, strict=True))
    assert inputs["brake.pulley.inertia"] == float(result.scene.brake.pulley.inertia)
    assert (read.materials.name[0], read.materials.density[1]) == ("steel_20L", 2000.0)
    assert list(read.places.node) == list(result.nodes)
    for name in read.series._fieldnames:
        assert len(name) <= 63
        assert name.isidentifier()
        assert name.isascii()


def test_files_that_are_not_read_back(result, tmp_path, monkeypatch):
    for suffix in (".xlsx", ".mat"):
        path = sb.save(sb.dataset(result, [0.0, 1.0]), tmp_path / f"run{suffix}")
        with pytest.raises(sb.InputError, match=r"not read back — keep the result as \.nc"):
            sb.read_result(path)
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(sb.InputError, match=r"openpyxl: is missing.*pip install 'simbrake\[tables\]'"):
        sb.save(result, tmp_path / "x.xlsx")
    assert not (tmp_path / "x.xlsx").exists()
