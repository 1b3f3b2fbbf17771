"""Tables as arrays and data frames; own tracks; what keeps what alive."""

import gc

import numpy as np
import pytest

import umbracast


def test_a_column_is_an_array_that_nobody_can_write_to_and_that_keeps_its_table(outcome):
    x_m = outcome.tracks["x_m"]
    assert x_m.dtype == np.float64 and not x_m.flags.writeable and x_m.base is not None
    assert np.shares_memory(x_m, outcome.tracks["x_m"])
    with pytest.raises(ValueError):
        x_m[0] = 1.0
    alone = umbracast.forecast({"id": [1], "t": [0.1], "x": [1.5], "y": [0.0], "vx": [1.0], "vy": [0.0]})["x_m"]
    gc.collect()
    assert alone.tolist() == [1.5]


def test_null_is_not_a_number_and_none_among_names(outcome, scene):
    onset = outcome.links["onset_p50_s"]
    assert np.isnan(onset).any()
    assert scene.people_links["self_blocked"].dtype.kind in "bf"
    assert outcome.links["access_point"].dtype.kind == "U"


def test_polars_reads_a_table_where_it_lies(outcome):
    polars = pytest.importorskip("polars")
    frame = polars.DataFrame(outcome.links)
    assert frame.columns == outcome.links.keys() and frame.height == len(outcome.links)
    assert frame["onset_p50_s"].null_count() == int(np.isnan(outcome.links["onset_p50_s"]).sum())
    assert frame["track"].dtype == polars.UInt64 and frame["p_w3"].to_list() == outcome.links["p_w3"].tolist()


def test_pyarrow_reads_a_table_where_it_lies(outcome):
    pyarrow = pytest.importorskip("pyarrow")
    table = pyarrow.table(outcome.tracks)
    assert table.schema.field("track").type == pyarrow.uint64() and not table.schema.field("x_m").nullable
    column = table["x_m"].chunk(0)
    assert column.buffers()[1].address == outcome.tracks["x_m"].ctypes.data
    assert pyarrow.schema(outcome.tracks) == table.schema


def test_pandas_reads_a_table(outcome):
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(dict(outcome.links))
    assert list(frame.columns) == outcome.links.keys() and len(frame) == len(outcome.links)


OWN = {"id": [7, 8], "time_s": [0.1, 0.1], "x_m": [4.0, 6.0], "y_m": [0.0, -0.8], "vx_mps": [0.0, 0.0], "vy_mps": [0.0, 1.3]}


def test_own_tracks_come_as_dict_or_any_data_frame():
    expected = umbracast.cast(OWN).links["p_w9"].tolist()
    assert expected[0] > 0.5 > expected[1]
    forms = [{name: np.array(values) for name, values in OWN.items()}]
    for module, make in [("polars", "DataFrame"), ("pandas", "DataFrame"), ("pyarrow", "table")]:
        try:
            forms.append(getattr(__import__(module), make)(OWN))
        except ImportError:
            print(f"skipped: {module} is not installed")
    for form in forms:
        assert umbracast.cast(form).links["p_w9"].tolist() == expected, type(form)


def test_covariances_heights_headings_and_forecasts_are_used_where_they_are_given():
    usual = umbracast.cast(OWN).links["p_w9"][0]
    lower = umbracast.cast({**OWN, "height_m": [1.7, 0.9]}).links["p_w9"][0]
    unsure = umbracast.cast({**OWN, "cov_xx_m2": [1.0, 1.0], "cov_yy_m2": [1.0, 1.0]}).links["p_w9"][0]
    assert lower < usual and unsure < usual
    stays = {f"{axis}_s{step}_m": OWN[f"{axis}_m"] for step in range(1, 10) for axis in "xy"}
    assert umbracast.cast({**OWN, **stays}).links["p_w9"][0] < 0.5
    turned = umbracast.cast({**OWN, "heading_rad": [0.0, 1.0], "heading_sigma_rad": [0.1, 0.1]})
    assert turned.tracks["heading_rad"].tolist() == [0.0, 1.0]


def test_tracks_of_the_pipeline_can_be_cast_again(outcome, scene):
    again = umbracast.cast(outcome, scene.site)
    assert (again.tracks["x_s9_m"] == outcome.tracks["x_s9_m"]).all()
    assert len(again.links) == len(outcome.links)


def test_every_mode_casts_and_forecasts():
    for mode in ["hdl", "paper", "default"]:
        assert len(umbracast.cast(OWN, mode=mode).links) == 4
        assert umbracast.forecast(OWN, mode=mode)["x_s1_m"].shape == (2,)


def test_points_of_a_frame_lie_in_the_hall(scene):
    frame = scene.frames[3]
    assert frame.points.shape == (len(frame.sensors), 3) and len(frame.times_ns) == len(frame.sensors)
    assert abs(frame.points[:, :2]).max() < 17.5 and frame.points[:, 2].min() > -0.5
    assert abs(frame.times_ns - frame.time_ns).max() < 110_000_000


def test_clouds_of_one_sensor_are_steps_too():
    pipeline = umbracast.Pipeline()
    rng = np.random.default_rng(1)
    outcome = pipeline.step([rng.uniform(-5, 5, (100, 3)), np.zeros((0, 3))])
    assert outcome.frame == 0 and outcome.foreground.shape[1] == 3
    assert pipeline.step(np.zeros((1, 3)), time_ns=400_000_000).time_ns == 400_000_000


def test_coverage_has_a_column_for_every_sensor_and_access_point():
    site = umbracast.Site()
    seen = umbracast.coverage(site, step_m=5.0, headings=1)
    assert len(seen) > 10
    assert {f"returns_{name}" for name in site.sensors} <= set(seen.keys())
    assert {f"static_blocked_{name}" for name in site.access_points} <= set(seen.keys())


def test_a_picture_of_one_link_beside_its_truth(outcome, scene):
    pytest.importorskip("matplotlib").use("agg")
    axes = umbracast.plot(outcome, scene, access_point="side")
    assert len(axes.lines) == 1 and axes.get_xlabel() == "s"
    assert len(umbracast.plot(outcome).lines) == 1
