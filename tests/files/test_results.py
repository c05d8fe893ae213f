"""Results as labelled data: values, units, files that lose nothing, provenance, running
again, comparing."""

import math
import pathlib

import jax
import numpy as np
import pytest
import xarray as xr
from helpers import all_equal, all_near, input_error, near
from result_scenes import heated_stop
from scenes import closed_form, stop_run, stop_scene
from staged_scenes import stop as staged_stop

import simbrake as sb
from simbrake.results import SERIES_COLUMNS

FOLDER = pathlib.Path(__file__).parent


@pytest.fixture(scope="module")
def plain():
    return stop_run()


@pytest.fixture(scope="module")
def heated():
    return sb.simulate(heated_stop())


@pytest.fixture(scope="module")
def staged():
    return sb.simulate(staged_stop())


RESULTS = ["plain", "heated", "staged"]


@pytest.fixture(params=RESULTS)
def result(request):
    return request.getfixturevalue(request.param)


def test_variables_have_units_and_meanings(result):
    data = sb.dataset(result)
    assert {"time", "lining", "event"} <= set(data.dims)
    for name, variable in data.variables.items():
        assert variable.attrs["units"], name
        assert len(variable.attrs["meaning"]) >= 4, name
    series = result.series([0.0])
    apart = len(series.pairs) > 1
    for field, column in series._asdict().items():
        if field not in ("t", "pairs"):
            assert (field in data) == (column is not None), field
            assert column is None or data[field].dims[0] == "time"
    for pair, columns in series.pairs.items():
        for field, column in columns._asdict().items():
            name = f"{pair}_{field}"
            assert (name in data) == (apart and column is not None)
            assert name not in data or data[name].ndim == column.ndim


def test_values_on_both_sides_of_events(result):
    data = sb.dataset(result)
    times = data["time"].values
    assert np.all(np.diff(times) >= 0)
    events = np.unique([event.time for event in result.events if event.time > 0])
    for side in (-1, 1):
        at = times[data["side"].values == side]
        assert set(events) <= set(at)
        assert np.unique(at).size == at.size
    for left, rows in ((True, data["side"] == -1), (False, data["side"] >= 0)):
        part = data.isel(time=np.flatnonzero(rows))
        series = result.series(times[rows], left=left)
        columns = {name: getattr(series, name) for name in SERIES_COLUMNS}
        for pair, found in series.pairs.items():
            columns |= {
                f"{pair}_{name}": column for name, column in found._asdict().items()
            }
        assert ("internal_torque" in data) == (len(series.pairs) > 1)
        for name in set(columns) & set(data.data_vars):
            all_equal(
                part[name].values.reshape(part.time.size, -1),
                np.reshape(columns[name], (part.time.size, -1)),
            )
    once = data.isel(time=data.side >= 0)
    assert np.all(np.diff(once["time"]) > 0)


def test_events_metrics_and_energies(plain):
    data = sb.dataset(plain)
    truth = closed_form()
    stop = data["event_time"].values[data["event_name"] == "stop"]
    all_near(stop, truth["stop"], 1e-10)
    all_near(data["stopping_time"], truth["stop"], 1e-10)
    limits = data["event_name"].values == "lining_limit"
    all_equal(data["event_lining"].values[limits], np.arange(20) + 1)
    all_near(data["event_time"].values[limits], truth["limits"], 1e-10)
    near(data["energy.kinetic_change"].item(), -0.5 * 800 * 20**2, 1e-12)
    assert data["energy.closure"].attrs["units"] == "1"
    assert data["max_tension_lining"].item() == 20
    assert data["status"].item() == "stopped"
    assert sb.dataset(stop_run(end=0.5))["stopping_time"].item() == math.inf


def test_walls_have_their_layers_and_depths(heated):
    data = sb.dataset(heated)
    assert data["rim_layer_temperature"].dims == ("time", "rim_layer")
    # layers that grow by half: 1 + 1.5 + 2.25 parts of 28 mm
    edges = np.cumsum([0.0, 1.0, 1.5, 2.25]) / 4.75 * 0.028
    all_near(data["rim_depth"], (edges[1:] + edges[:-1]) / 2, 1e-14)
    assert data["rim_depth"].attrs["units"] == "m"
    assert data["lining_layer_temperature"].dims == (
        "time",
        "lining_copy",
        "lining_layer",
    )
    for copy in (1, 2):
        for layer in (1, 2):
            own = data["lining_layer_temperature"].sel(
                lining_copy=copy, lining_layer=layer
            )
            all_equal(own, data["temperature"].sel(node=f"lining[{copy},{layer}]"))
    all_equal(
        data["rim_layer_temperature"].sel(rim_layer=3),
        data["temperature"].sel(node="rim[3]"),
    )
    assert data["rim_temperature"].dims == ("time",)
    assert data["lining_temperature"].dims == ("time", "lining")


def test_stages(staged):
    data = sb.dataset(staged)
    assert data["stage_name"].values.tolist() == [stage.name for stage in staged.stages]
    all_equal(data["stage_start"][1:], data["stage_end"][:-1])
    heat = data["stage_heat_internal"].sum() + data["stage_heat_external"].sum()
    all_near(heat, data["energy.friction_heat"], 1e-12)


def test_chosen_times(plain):
    stop = float(plain.stopping_time)
    data = sb.dataset(plain, [1.0, stop, 0.5])
    assert data["time"].values.tolist() == [0.5, stop, stop, 1.0]
    assert data["side"].values.tolist() == [0, -1, 1, 0]
    for bad in ([0.1, 9.0], [math.nan], [], [[0.1]], ["soon"]):
        with input_error(match="times"):
            sb.dataset(plain, bad)


def test_traced_and_batched_results(plain):
    """Numbers work there, words and tables do not."""
    batch = jax.tree.map(lambda leaf: np.stack([leaf, leaf]), plain)
    with pytest.raises(ValueError, match="outside of jit"):
        jax.eval_shape(sb.dataset, plain)
    with pytest.raises(ValueError, match="outside of jit"):
        sb.results.provenance(batch)
    for find in (
        lambda run: run.metrics,
        lambda run: run.ok,
        lambda run: run.events,
        lambda run: run.summary(),
        lambda run: run.verdict(),
        lambda run: run.derivative_notes(),
    ):
        with input_error(match="result: is traced"):
            jax.eval_shape(lambda run, find=find: find(run) and 1.0, plain)
        with input_error(match="is a batch of"):
            find(batch)


@pytest.mark.parametrize(
    "result",
    [
        pytest.param(kind, marks=[pytest.mark.smoke] if kind == "plain" else [])
        for kind in RESULTS
    ],
    indirect=True,
)
def test_files_give_the_same_data_set_back(result, tmp_path):
    data = sb.dataset(result)
    path = sb.save(data, tmp_path / "new" / "run.nc")
    back = sb.read_result(path)
    assert back.identical(data)
    for name, variable in data.variables.items():
        assert back[name].dtype.kind == variable.dtype.kind, name
        if variable.dtype.kind == "f":
            assert (
                back[name].values.tobytes()
                == np.ascontiguousarray(variable.values).tobytes()
            ), name
    assert set(back.coords) == set(data.coords)
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_run_without_events_and_failed_run(tmp_path):
    still = stop_run(w0=0.0, T0=0.0, end=1.0)
    failed = sb.simulate(stop_scene(), max_steps=8, throw=False)
    assert not [e for e in still.events if e.name != "release"]
    for one in (still, failed):
        back = sb.read_result(sb.save(one, tmp_path / "x.nc"))
        assert back["status"].item() == one.status
        assert back["event_time"].size == len(one.events)
    assert back["code"].item() == 1
    assert back["time"].values[-1] < 5.0


@pytest.fixture(scope="module")
def file(plain, tmp_path_factory):
    """A data set, and the content of its file."""
    data = sb.dataset(plain, np.linspace(0.0, 5.0, 12))
    return data, sb.save(data, tmp_path_factory.mktemp("files") / "x.nc").read_bytes()


def test_damaged_and_foreign_files_are_named(file, tmp_path):
    content = file[1]
    path = tmp_path / "x.nc"
    cut = [
        content[: int(share * len(content))]
        for share in (0.0, 0.001, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99)
    ]
    for wrong in (
        *cut,
        content[:-1],
        b"a,b\n1,2\n",
        b"CDF\x01",
        b"PAR1PAR1",
        b"\x89HDF\r\n\x1a\n",
        b"\xff" * 99,
    ):
        path.write_bytes(wrong)
        with input_error(match=r"x\.nc"):
            sb.read_result(path)


def test_one_wrong_byte_is_no_other_result(file, tmp_path):
    (data, content) = file
    path = tmp_path / "x.nc"
    refused = 0
    for place in np.random.default_rng(3).integers(0, len(content), 60):
        wrong = bytearray(content)
        wrong[place] ^= 1 << int(place) % 8
        path.write_bytes(wrong)
        try:
            assert sb.read_result(path).identical(
                data
            )  # some bytes mean nothing, as those that fill up
        except sb.InputError:
            refused += 1
    assert refused > 20


def test_files_of_earlier_releases_are_read(tmp_path):
    """Written once and kept: its checksum has to be that of today. Files with the hash
    from before it are read too."""
    data = sb.read_result(FOLDER / "golden" / "result.nc")
    before = xr.load_dataset(
        FOLDER / "golden" / "result.nc", engine="scipy", decode_times=False
    )
    before.attrs["checksum"] = "0" * 64
    del before.attrs["sha256"]
    before.to_netcdf(tmp_path / "before.nc", engine="scipy")
    assert sb.read_result(tmp_path / "before.nc").identical(data)
    assert data["status"].item() == "stopped"
    near(data["stopping_time"], closed_form(n=2, beta=120.0, C=1e6)["stop"], 1e-9)


def test_wrong_places_and_suffixes(plain, tmp_path):
    (tmp_path / "folder.nc").mkdir()
    (tmp_path / "file").write_text("", "utf-8")
    foreign = sb.dataset(plain).assign_attrs(format="mine")
    for call, *given in (
        (sb.save, plain, tmp_path / "x.csv"),
        (sb.save, plain, tmp_path / "folder.nc"),
        (sb.save, plain, tmp_path / "file" / "x.nc"),
        (sb.save, foreign, tmp_path / "x.nc"),
        (sb.read_result, tmp_path / "x.csv"),
        (sb.read_result, tmp_path / "x.nc"),
    ):
        with input_error():
            call(*given)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder.nc"]
