"""A benchmark of predictors: what a forecast of where people walk is worth to radio links.

Scenes are simulated crowds with fixed seeds, so everybody has the same splits. A predictor reads who was where in the last second
(true positions and velocities, ten steps of 100 ms) and says where everybody will be at the next nine steps, with covariances if it
has any. Stage 3 of the mode `default` casts the links of every predictor, and the scorer counts as in every report
(docs/CONVENTIONS.md). No sensor is simulated and no tracker runs.
"""

from __future__ import annotations

from typing import Callable, Iterable

import numpy as np

import umbracast

STEPS, OBSERVED = 9, 10
#: Preset and seed of every scene. Test scenes are of the seeds from 200,000 on, and nothing may be fitted to them.
SPLITS = {
    "train": [(preset, seed) for seed in range(1, 25) for preset in ("orca-03", "orca-06", "mixed")],
    "tuning": [(preset, seed) for seed in range(100_000, 100_004) for preset in ("orca-03", "orca-06", "mixed")],
    "test": [(preset, seed) for seed in range(200_000, 200_010) for preset in ("orca-03", "orca-06", "mixed")],
}
Arrays = dict[str, np.ndarray]
Predictor = Callable[[Arrays], Arrays]


def scenes(split: str, most: int | None = None) -> list[umbracast.Scene]:
    """The scenes of a split, or the first `most` of them."""
    chosen = SPLITS[split][:most]
    return [
        umbracast.simulate(preset=preset, seed=seed, scene=number, sensors=False)
        for number, (preset, seed) in enumerate(chosen)
    ]


def observed(scene: umbracast.Scene) -> Arrays:
    """Everybody who still walks, as tracks: number, time, position, velocity."""
    people = scene.people
    walking = ~people["arrived"]
    columns = {"scene": "scene", "frame": "frame", "time_ns": "time_ns", "person": "track"}
    columns |= {name: name for name in ["x_m", "y_m", "vx_mps", "vy_mps"]}
    tracks = {ours: people[name][walking] for name, ours in columns.items()}
    known = np.full(len(tracks["track"]), 1e-6)  # positions and velocities are the truth
    return tracks | {f"cov_{of}": known for of in ["xx_m2", "yy_m2", "vxvx_m2ps2", "vyvy_m2ps2"]}


def windows(tracks: Arrays) -> tuple[np.ndarray, np.ndarray]:
    """Rows with ten steps behind them and nine before them: the rows of the last observed step, and positions (n, 19, 2)."""
    order = np.lexsort((tracks["frame"], tracks["track"], tracks["scene"]))
    places = np.stack([tracks["x_m"], tracks["y_m"]], axis=1)[order]
    length = OBSERVED + STEPS
    if len(order) < length:
        return np.empty(0, int), np.empty((0, length, 2))
    first = np.arange(len(order) - length + 1)
    last = first + length - 1
    same = (tracks["track"][order][first] == tracks["track"][order][last])
    same &= tracks["frame"][order][last] - tracks["frame"][order][first] == length - 1
    same &= tracks["scene"][order][first] == tracks["scene"][order][last]
    first = first[same]
    return order[first + OBSERVED - 1], places[first[:, None] + np.arange(length)]


def past(tracks: Arrays) -> tuple[np.ndarray, np.ndarray]:
    """Rows with ten steps behind them, and these positions (n, 10, 2)."""
    order = np.lexsort((tracks["frame"], tracks["track"], tracks["scene"]))
    places = np.stack([tracks["x_m"], tracks["y_m"]], axis=1)[order]
    first = np.arange(max(len(order) - OBSERVED + 1, 0))
    last = first + OBSERVED - 1
    same = (tracks["track"][order][first] == tracks["track"][order][last])
    same &= tracks["frame"][order][last] - tracks["frame"][order][first] == OBSERVED - 1
    first = first[same]
    return order[first + OBSERVED - 1], places[first[:, None] + np.arange(OBSERVED)]


def of_mode(mode: str) -> Predictor:
    """Stage 2 of a mode."""

    def predict(tracks: Arrays) -> Arrays:
        ahead = umbracast.forecast(tracks, mode=mode)
        steps = [name for name in ahead.keys() if "_s" in name and name.split("_s")[-1][0].isdigit()]
        # The table is in order of time and number; the tracks may be in another.
        order = np.lexsort((tracks["track"], tracks["time_ns"]))
        made = {}
        for name in steps:
            made[name] = np.empty(len(order))
            made[name][order] = ahead[name]
        return made

    return predict


def score(predictor: Predictor, test: Iterable[umbracast.Scene]) -> dict[str, float | None]:
    """F1 of links blocked within 300 ms at both access points, that of onsets, and the mean error of positions at 900 ms."""
    test = list(test)
    runs, errors = [], []
    for scene in test:
        tracks = observed(scene)
        ahead = predictor(tracks)
        outcome = umbracast.cast(tracks | ahead)
        runs.append(outcome)
        rows, places = windows(tracks)
        said = np.stack([ahead[f"x_s{STEPS}_m"], ahead[f"y_s{STEPS}_m"]], axis=1)[rows]
        errors.append(np.linalg.norm(said - places[:, -1], axis=1))
    scores = umbracast.evaluate(runs, test)
    found: dict[str, float | None] = {}
    for place in test[0].site.access_points:
        for name in ["f1", "onset_f1", "brier"]:
            found[f"{place} {name}"] = scores.value(name, access_point=place, window=3)
    found["error at 900 ms, m"] = float(np.concatenate(errors).mean())
    return found


def leaderboard(scored: dict[str, dict[str, float | None]]) -> str:
    """The scores of several predictors as a table in Markdown."""
    names = list(next(iter(scored.values())))
    lines = ["| predictor | " + " | ".join(names) + " |", "|---|" + "---|" * len(names)]
    for predictor, of in scored.items():
        cells = ["-" if of[name] is None else f"{of[name]:.3f}" for name in names]
        lines.append(f"| {predictor} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def constant_velocity(tracks: Arrays) -> Arrays:
    """Everybody goes on as now; the velocity is known to a tenth of a metre a second on each axis."""
    ahead: Arrays = {}
    for step in range(1, STEPS + 1):
        later_s = 0.1 * step
        for axis in "xy":
            ahead[f"{axis}_s{step}_m"] = tracks[f"{axis}_m"] + later_s * tracks[f"v{axis}_mps"]
        for of in ["xx", "yy"]:
            ahead[f"cov_{of}_s{step}_m2"] = np.full(len(tracks["track"]), (0.1 * later_s) ** 2)
    return ahead


def main() -> None:
    """Prints the scores of what every predictor stands beside, on all test scenes."""
    test = scenes("test")
    beside = {"constant velocity": constant_velocity, "paper": of_mode("paper"), "default": of_mode("default")}
    scored = {name: score(predictor, test) for name, predictor in beside.items()}
    names = list(scored["paper"])
    print("predictor".ljust(18), *(name.rjust(19) for name in names))
    for predictor, of in scored.items():
        cells = ["-" if of[name] is None else f"{of[name]:.3f}" for name in names]
        print(predictor.ljust(18), *(cell.rjust(19) for cell in cells))


if __name__ == "__main__":
    main()
