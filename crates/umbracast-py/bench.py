"""What a step costs from Python, and how many links are cast in a second. Prints; nothing depends on it.

`python crates/umbracast-py/bench.py [COMMAND]`, where COMMAND is `umbracast` of the same build: its own time stands beside.
"""

import json
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

import umbracast


def step_ms(frames, empty, site):
    pipeline = umbracast.Pipeline(site)
    pipeline.learn(empty)
    times = []
    for frame in frames:
        began = time.perf_counter()
        pipeline.step(frame)
        times.append(1e3 * (time.perf_counter() - began))
    return statistics.median(times), statistics.fmean(times)


def links_a_second(people, frames):
    """Of people who walk across the hall, positions and velocities only."""
    rng = np.random.default_rng(7)
    start, toward = rng.uniform(-12, 12, (people, 2)), rng.normal(0, 1, (people, 2))
    k = np.repeat(np.arange(frames), people)
    who = np.tile(np.arange(people), frames)
    at = start[who] + 0.1 * k[:, None] * toward[who]
    at = np.abs((at + 12) % 48 - 24) - 12
    tracks = {"id": who, "time_s": 0.1 * (k + 1), "x": at[:, 0], "y": at[:, 1]}
    tracks |= {"vx": toward[who, 0], "vy": toward[who, 1]}
    began, busy = time.perf_counter(), time.process_time()
    outcome = umbracast.cast(tracks)
    return len(outcome.links) / (time.perf_counter() - began), len(outcome.links) / (time.process_time() - busy)


def main():
    scene = umbracast.simulate()
    frames, empty = scene.frames, scene.empty
    runs = [step_ms(frames, empty, scene.site) for _ in range(3)]
    print(f"step from Python: {min(run[0] for run in runs):.3f} ms a frame (median, best of 3), {len(frames)} frames")
    if len(sys.argv) > 1:
        best = []
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.argv[1], "simulate", "--out", f"{folder}/sim", "--quiet"], check=True, capture_output=True)
            for _ in range(3):
                run = [sys.argv[1], "run", f"{folder}/sim", "--out", f"{folder}/out", "--threads", "1", "--quiet"]
                subprocess.run(run, check=True, capture_output=True)
                with open(f"{folder}/out/run.json") as file:
                    best.append(json.load(file)["step_ms_median"])
        print(f"step in Rust:     {min(best):.3f} ms a frame (median, best of 3)")
    for people in [10, 40]:
        wall, busy = max(links_a_second(people, 200) for _ in range(3))
        print(f"{people} people, 2 access points: {wall:,.0f} links a second, {busy:,.0f} a second and core")


if __name__ == "__main__":
    main()
