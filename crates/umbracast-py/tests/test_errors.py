"""Errors are `ValueError` with file or place, key, expected and found."""

import numpy as np
import pytest

import umbracast

OWN = {"id": [7], "time_s": [0.1], "x_m": [4.0], "y_m": [0.0], "vx_mps": [0.0], "vy_mps": [0.0]}


def told(call):
    with pytest.raises(ValueError) as error:
        call()
    return str(error.value)


def test_sites(tmp_path):
    path = tmp_path / "hall.toml"
    path.write_text("[site.hall]\nheight_m = -1.0\n")
    message = told(lambda: umbracast.Site(path))
    assert "hall.toml" in message and "height_m" in message and "expected" in message and "found -1" in message
    assert "No such file" in told(lambda: umbracast.Pipeline(tmp_path / "none.toml"))
    assert "mode: expected hdl, paper or default, found" in told(lambda: umbracast.Pipeline(mode="mine"))
    assert "site: expected a path or a Site, found int" in told(lambda: umbracast.simulate(3))


def test_tracks(tmp_path):
    assert "tracks: row 0, column x_m: expected a number, found \"a\"" in told(
        lambda: umbracast.cast({**OWN, "x_m": ["a"]})
    )
    missing = {name: values for name, values in OWN.items() if name != "vx_mps"}
    assert "column vx_mps: expected a number, found no such column but" in told(lambda: umbracast.cast(missing))
    assert "column y_m: expected 1 values as in column id, found 2" in told(lambda: umbracast.cast({**OWN, "y_m": [0, 1]}))
    assert "column x_m: expected one dimension, found 2" in told(lambda: umbracast.cast({**OWN, "x_m": [[1.0]]}))
    path = tmp_path / "own.csv"
    path.write_text("id,t,x,y,vx,vy\n1,0.1,0,0,0,nothing\n")
    message = told(lambda: umbracast.cast(path))
    assert "own.csv: line 2, column vy_mps: expected a number, found \"nothing\"" in message
    assert "site.handover: expected what a change of access point costs" in told(lambda: umbracast.decide(OWN))
    assert "expected a table with named columns" in told(lambda: umbracast.cast(3))


def test_recordings(tmp_path):
    path = tmp_path / "scene.mcap"
    path.write_bytes(b"no recording")
    assert "scene.mcap" in told(lambda: umbracast.read(path))
    assert "no such file or folder" in told(lambda: umbracast.read(tmp_path / "none.pcap"))
    (tmp_path / "empty").mkdir()
    assert "expected .mcap, .db3, .pcd or .pcap files in the folder" in told(lambda: umbracast.read(tmp_path / "empty"))


def test_numbers():
    assert "people: expected 1 or more, found 0" in told(lambda: umbracast.simulate(people=0))
    assert "seconds: expected more than 0" in told(lambda: umbracast.simulate(seconds=0))
    assert "preset: " in told(lambda: umbracast.simulate(preset="march"))
    assert "model: expected kirchhoff" in told(lambda: umbracast.loss_db((9, 0, 3), (0, 0, 1), [(1, 0)], model="mine"))
    assert "width_m: expected more than 0" in told(lambda: umbracast.loss_db((9, 0, 3), (0, 0, 1), [(1, 0)], width_m=0))
    assert "shape (points, 3)" in told(lambda: umbracast.Pipeline().step(np.zeros((4, 2))))
    assert "sensor below 2, found 7" in told(lambda: umbracast.Pipeline().feed([(7, 0, b"")]))


def test_tables(outcome, scene):
    with pytest.raises(KeyError, match="expected one of scene, frame"):
        outcome.links["p"]
    scores = umbracast.evaluate(outcome, scene)
    assert "score: expected f1" in told(lambda: scores.value("joy"))
    assert "window: expected 1 to 9 steps" in told(lambda: scores.value(window=10))
    answers = {"tracks": outcome.tracks, "links": {**dict(outcome.links), "access_point": ["roof"] * len(outcome.links)}}
    assert 'expected the name of an access point of the site, found "roof"' in told(
        lambda: umbracast.evaluate(answers, scene)
    )


def test_a_recording_that_is_cut_off_is_read_to_its_end_with_a_warning(command, tmp_path):
    command("simulate", "--people", 2, "--out", tmp_path / "sim")
    path = tmp_path / "sim" / "scene-0000.mcap"
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.warns(UserWarning, match="data was lost"):
        frames = list(umbracast.read(path))
    assert len(frames) > 10


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_recording_tells_where_its_sensors_hang(command, tmp_path):
    command("simulate", "--people", 2, "--out", tmp_path / "sim")
    recording = umbracast.read(tmp_path / "sim" / "scene-0000.mcap")
    found = umbracast.calibrate(recording)
    assert len(found["sensors"]) == 2 and "position_m" in found["toml"]


def test_reports():
    pipeline = umbracast.Pipeline()
    assert "report 0: access_point: expected one of the site's that has a radio (none has), found \"side\"" in told(
        lambda: pipeline.hear([(100_000_000, "side", 7, -60.0)])
    )
    assert "report 0: access_point" in told(lambda: pipeline.hear([(100_000_000, "side", 7, -60.0, True)]))
