"""Python and the command give the same tables, to the last bit."""

import csv
import hashlib
import math

import pytest

import umbracast

SCENES = [("orca-03", 200_000), ("orca-06", 200_007), ("mixed", 200_011)]
RADIO = """
[[site.access_points]]
name = "corner"
position_m = [14.0, 3.0, 3.0]
[site.access_points.radio]
carrier_ghz = 28.0

[[site.access_points]]
name = "wall"
position_m = [-14.0, 0.0, 3.0]
[site.access_points.radio]
carrier_ghz = 60.0

[site.handover]
"""


def digest(table):
    """Of every value of every column, by the bytes that the command writes into CSV."""
    text = hashlib.sha256(",".join(table.keys()).encode())
    columns = [[written(value) for value in table[name].tolist()] for name in table.keys()]
    for row in zip(*columns):
        text.update("\n".encode() + ",".join(row).encode())
    return text.hexdigest()


def written(value):
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    # Python's shortest number that reads back, as Rust's; a hex text has no choice of form.
    return value.hex() if isinstance(value, float) else str(value)


def digest_of_csv(path, table):
    kinds = {name: table[name].dtype.kind for name in table.keys()}
    with open(path, newline="") as file:
        rows = csv.reader(file)
        names = next(rows)
        text = hashlib.sha256(",".join(names).encode())
        for row in rows:
            cells = [cell(kinds[name], value) for name, value in zip(names, row)]
            text.update("\n".encode() + ",".join(cells).encode())
    return text.hexdigest()


def cell(kind, value):
    if value in ("", "NaN"):
        return ""
    if kind == "f":
        return float({"true": 1, "false": 0}.get(value, value)).hex()
    return value


@pytest.fixture(scope="module", params=SCENES, ids=lambda scene: scene[0])
def both(request, command, tmp_path_factory):
    """Folders of the command, and what Python makes of the same scene."""
    preset, seed = request.param
    folder = tmp_path_factory.mktemp(preset)
    site = folder / "site.toml"
    site.write_text(RADIO)
    command("simulate", "--site", site, "--preset", preset, "--seed", seed, "--out", folder / "sim", "--csv", "--people", 6)
    command("run", folder / "sim", "--out", folder / "out", "--csv")
    return folder, umbracast.simulate(site, preset=preset, seed=seed, people=6)


def test_truth_and_answers_have_the_digests_of_the_command(both):
    folder, scene = both
    for name in ["people", "people_links"]:
        table = getattr(scene, name)
        assert digest(table) == digest_of_csv(folder / "sim" / f"{name}.csv", table), name
    pipeline = umbracast.Pipeline(scene.site)
    pipeline.learn(scene.empty)
    in_memory = pipeline.run(scene.frames)
    recording = umbracast.read(folder / "sim" / "scene-0000.mcap")
    pipeline = umbracast.Pipeline(recording.site, scene=recording.scene)
    pipeline.learn(recording.empty)
    read = pipeline.run(recording)
    for name in ["detections", "tracks", "links", "links_db", "decisions"]:
        for outcome in [in_memory, read]:
            table = getattr(outcome, name)
            assert len(table) > 0, name
            assert digest(table) == digest_of_csv(folder / "out" / f"{name}.csv", table), name


def test_whoever_is_nobodys_thing_has_nan_for_an_owner_and_not_track_0(both):
    _, scene = both
    pipeline = umbracast.Pipeline(scene.site, threads=2)
    pipeline.learn(scene.empty)
    owners = pipeline.run(scene.frames[:20]).tracks["part_of"]
    assert len(owners) > 0 and all(math.isnan(owner) for owner in owners)


def test_frame_by_frame_and_by_packets_is_the_same(both):
    _, scene = both
    whole = umbracast.Pipeline(scene.site)
    stepped, fed = umbracast.Pipeline(scene.site), umbracast.Pipeline(scene.site)
    for pipeline in [whole, stepped, fed]:
        pipeline.learn(scene.empty)
    frames = scene.frames[:20]
    expected = digest(whole.run(frames).links)
    steps = [stepped.step(frame) for frame in frames]
    assert sum(len(step.links) for step in steps) > 0
    packets = [packet for packet in scene.packets() if packet[1] < 2_200_000_000]
    outcomes = [*fed.feed(packets)][:20]
    for one, other in zip(steps, outcomes, strict=True):
        assert one.frame == other.frame and digest(one.tracks) == digest(other.tracks)
    pandas = pytest.importorskip("pandas")
    joined = pandas.concat([pandas.DataFrame(dict(step.links)) for step in steps])
    assert digest(Like(joined)) == expected


class Like:
    """A data frame as a table."""

    def __init__(self, frame):
        self.frame = frame

    def keys(self):
        return list(self.frame.columns)

    def __getitem__(self, name):
        return self.frame[name].to_numpy()


def test_own_tracks_cast_as_the_command_casts_them(both, command):
    folder, scene = both
    table = folder / "own.csv"
    people = scene.people
    with open(table, "w") as file:
        file.write("id,time_s,x,y,vx,vy\n")
        for row in zip(*(people[name] for name in ["person", "time_ns", "x_m", "y_m", "vx_mps", "vy_mps"])):
            file.write(f"{row[0]},{float(row[1]) * 1e-9!r},{','.join(repr(float(v)) for v in row[2:])}\n")
    command("cast", table, "--site", folder / "site.toml", "--out", folder / "cast", "--csv")
    from_file = umbracast.cast(table, scene.site)
    names = {"person": "track", "time_ns": "time_ns", "x_m": "x_m", "y_m": "y_m", "vx_mps": "vx_mps", "vy_mps": "vy_mps"}
    from_arrays = umbracast.cast({ours: people[name] for name, ours in names.items()}, scene.site)
    for name in ["tracks", "links", "links_db", "decisions"]:
        for outcome in [from_file, from_arrays]:
            made = getattr(outcome, name)
            assert digest(made) == digest_of_csv(folder / "cast" / f"{name}.csv", made), name
    assert digest(umbracast.decide(table, scene.site)) == digest(from_file.decisions)
    assert (umbracast.forecast(table, scene.site)["x_s9_m"] == from_file.tracks["x_s9_m"]).all()


def test_scores_are_those_of_the_command(both, command):
    folder, scene = both
    told = command("evaluate", folder / "out", "--truth", folder / "sim", "--out", folder / "report", "--json")
    scores = umbracast.evaluate(folder / "out", folder / "sim")
    import json

    assert scores.to_dict()["groups"][0]["links"] == json.loads(told)["groups"][0]["links"]
    tables = {name: getattr(scene, name) for name in ["people", "people_links"]}
    pipeline = umbracast.Pipeline(scene.site)
    pipeline.learn(scene.empty)
    outcome = pipeline.run(scene.frames)
    answers = {"tracks": dict(outcome.tracks), "links": dict(outcome.links)}
    from_tables = umbracast.evaluate(answers, tables, site=scene.site)
    assert from_tables.to_dict()["groups"][0]["links"] == scores.to_dict()["groups"][0]["links"]
    assert len(umbracast.matches(outcome, scene)) > 0
