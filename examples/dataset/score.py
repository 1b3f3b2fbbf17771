"""Scores forecasts of blockage against a data set of `umbracast network --dataset DIR --csv`. Needs nothing but Python.

    python3 score.py DIR ANSWERS [--split test]

ANSWERS is a folder with two tables of your method, whatever it is:

    tracks.csv    scene,time_ns,track,x_m,y_m[,confirmed]
    links_db.csv  scene,time_ns,access_point,track,p_out_w3[,loss_s3_p10_db,loss_s3_p50_db,loss_s3_p90_db]

`umbracast run DIR --csv --out ANSWERS` writes both. A track is a person's if it is the nearest within half a metre; each track belongs to
one person, the nearest pairs first. A link that nobody told of counts as one that was told to stay clear.
"""

import argparse
import csv
import math
import pathlib
from collections import defaultdict

GATE_M = 0.5
WINDOW = 3
BINS = 10
LIKELY = 0.5


def rows(path):
    with open(path, newline="") as file:
        yield from csv.DictReader(file)


def matched(people, tracks):
    """Whose track each person's is, the nearest pairs first."""
    pairs = sorted(
        (math.hypot(x - a, y - b), person, track)
        for person, (x, y) in people.items()
        for track, (a, b) in tracks.items()
        if math.hypot(x - a, y - b) < GATE_M
    )
    of_person, taken = {}, set()
    for _, person, track in pairs:
        if person not in of_person and track not in taken:
            of_person[person] = track
            taken.add(track)
    return of_person


def scored(folder, answers, split):
    scenes = {row["scene"] for row in rows(folder / "split.csv") if row["split"] == split}
    if not scenes:
        raise SystemExit(f"{folder / 'split.csv'}: expected scenes of the split {split!r}, found none")
    tracks = defaultdict(dict)
    for row in rows(answers / "tracks.csv"):
        if row["scene"] in scenes and row.get("confirmed", "true") == "true":
            tracks[row["scene"], row["time_ns"]][row["track"]] = (float(row["x_m"]), float(row["y_m"]))
    told = {}
    for row in rows(answers / "links_db.csv"):
        if row["scene"] in scenes:
            told[row["scene"], row["time_ns"], row["access_point"], row["track"]] = row
    people, labels = defaultdict(dict), []
    for row in rows(folder / "labels.csv"):
        if row["scene"] in scenes:
            people[row["scene"], row["time_ns"]][row["person"]] = (float(row["x_m"]), float(row["y_m"]))
            labels.append(row)
    of_frame = {key: matched(here, tracks.get(key, {})) for key, here in people.items()}
    counts = {"links": 0, "followed": 0, "both": 0, "told": 0, "true": 0, "onset_both": 0, "onset_told": 0, "onset_true": 0}
    squares, brier, inside, losses = 0.0, 0.0, 0, 0
    bins = [[0, 0.0, 0] for _ in range(BINS)]
    for row in labels:
        key = row["scene"], row["time_ns"]
        answer = told.get((*key, row["access_point"], of_frame[key].get(row["person"])))
        p = float(answer[f"p_out_w{WINDOW}"]) if answer else 0.0
        truth, now = row[f"out_w{WINDOW}"] == "true", row["out_now"] == "true"
        counts["links"] += 1
        counts["followed"] += answer is not None
        for name, wanted in (("", True), ("onset_", not now)):
            if wanted:
                counts[name + "both"] += truth and p >= LIKELY
                counts[name + "told"] += p >= LIKELY
                counts[name + "true"] += truth
        brier += (p - truth) ** 2
        of_bin = bins[min(int(p * BINS), BINS - 1)]
        of_bin[0] += 1
        of_bin[1] += p
        of_bin[2] += truth
        if answer and answer.get(f"loss_s{WINDOW}_p50_db"):
            low, middle, high = (float(answer[f"loss_s{WINDOW}_p{q}_db"]) for q in (10, 50, 90))
            loss = float(row[f"loss_s{WINDOW}_db"])
            if max(loss, middle) > 1.0:
                squares += (loss - middle) ** 2
                inside += low <= loss <= high
                losses += 1
    f1 = lambda name: 2.0 * counts[name + "both"] / max(counts[name + "told"] + counts[name + "true"], 1)
    links = counts["links"]
    yield "links", links
    yield "share followed", counts["followed"] / links
    yield f"F1 of out within {WINDOW * 100} ms", f1("")
    yield "the same where it is not out yet", f1("onset_")
    yield "expected calibration error", sum(abs(p - truth) for _, p, truth in bins) / links
    yield "Brier score", brier / links
    if losses:
        yield f"dB RMSE {WINDOW * 100} ms ahead, where either is above 1 dB", math.sqrt(squares / losses)
        yield "share of these within 10 to 90 %", inside / losses


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path, metavar="DIR")
    parser.add_argument("answers", type=pathlib.Path, metavar="ANSWERS")
    parser.add_argument("--split", default="test", choices=["train", "validation", "test"])
    arguments = parser.parse_args()
    for name, value in scored(arguments.folder, arguments.answers, arguments.split):
        print(f"{name:55} {value:.4f}" if isinstance(value, float) else f"{name:55} {value}")
