"""One run of each tracker over the detections, and one score for both sides' tracks."""

import time

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from exchange import Answer, read

NEAR_M = 0.5


def score(truth_m, rows):
    """MOTA and the changes of identity for each person and minute: a person and a track match within half a metre."""
    misses = strangers = switches = 0
    last = {}
    for frame, people_m in enumerate(truth_m):
        tracks = rows[rows[:, 0] == frame]
        apart_m = cdist(people_m, tracks[:, 2:])
        people, matched = linear_sum_assignment(np.minimum(apart_m, NEAR_M))
        near = apart_m[people, matched] < NEAR_M
        misses += len(people_m) - near.sum()
        strangers += len(tracks) - near.sum()
        for person, track in zip(people[near], tracks[matched[near], 1]):
            switches += last.get(person, track) != track
            last[person] = track
    frames, people = truth_m.shape[:2]
    return {
        "MOTA": 1 - (misses + strangers + switches) / (frames * people),
        "switches per person and minute": switches / people / (frames / 600),
    }


def run(tracker, frames_max=None):
    """`tracker()` makes a function from a frame's detections to (id, x, y) of each track that it believes in."""
    answer = Answer()
    for people in [100, 1000]:
        truth_m, counts = read(f"truth_{people}"), read(f"counts_{people}")
        frames = np.split(read(f"detected_{people}"), np.cumsum(counts)[:-1])[:frames_max]
        step, ms, rows = tracker(), [], []
        for frame, detected_m in enumerate(frames):
            start = time.perf_counter()
            tracks = step(detected_m)
            ms.append(1e3 * (time.perf_counter() - start))
            rows += [(frame, *track) for track in tracks]
        truth_m, rows = truth_m[: len(frames)], np.array(rows, dtype=float).reshape(-1, 4)
        theirs = score(truth_m, rows)
        for mode in ["paper", "default"]:
            ours = read(f"ours_{people}_{mode}")
            ours = score(truth_m, ours[ours[:, 0] < len(frames)])
            found = theirs | {f"ours: {name}": value for name, value in ours.items()}
            answer.case(f"{people} people, mode {mode}", ms, found)
    answer.print()
