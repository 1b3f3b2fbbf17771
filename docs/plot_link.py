"""Plots the probability that one link is blocked beside what happened.

    python docs/plot_link.py RUN TRUTH MATCHES PICTURE [PERSON [ACCESS_POINT [SCENE]]]

RUN is what `umbracast run` wrote, TRUTH what `umbracast simulate` wrote, MATCHES what `umbracast evaluate --out` wrote.
Without PERSON the link that is blocked for about half of the time is taken.
Needs pandas, pyarrow and matplotlib.
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import pandas as pd

WINDOW_STEPS = 3  # 300 ms: one step is 100 ms
KEYS = ["scene", "frame", "time_ns"]


def joined(run: Path, truth: Path, matches: Path) -> pd.DataFrame:
    """One row for each link of a person with a track in a frame: its truth and what was said of it."""
    links = pd.read_parquet(run / "links.parquet")
    people_links = pd.read_parquet(truth / "people_links.parquet")
    pairs = pd.read_parquet(matches / "matches.parquet")
    # Truth goes by person and the answer by track; `matches` says in each frame whose track is whose.
    table = people_links.merge(pairs, on=[*KEYS, "person"], how="left")
    return table.merge(links, on=[*KEYS, "access_point", "track"], how="left")


def blocked_within(link: pd.DataFrame, steps: int) -> pd.Series:
    """Truth of a window: blocked in one of the next `steps` frames. Null where the recording ends before."""
    ahead = [link["blocked"].astype("boolean").shift(-step) for step in range(1, steps + 1)]
    return pd.concat(ahead, axis=1).any(axis=1, skipna=False)


def one_link(table: pd.DataFrame, person: int | None, access_point: str | None, scene: int) -> pd.DataFrame:
    """The rows of one link in the order of time."""
    table = table[table["scene"] == scene]
    if access_point is not None:
        table = table[table["access_point"] == access_point]
    if person is None:
        share = table.groupby(["access_point", "person"])["blocked"].mean()
        access_point, person = (share - 0.5).abs().idxmin()
    else:
        access_point = access_point or table["access_point"].iloc[0]
    link = table[(table["person"] == person) & (table["access_point"] == access_point)]
    return link.sort_values("frame")


def plot(link: pd.DataFrame, picture: Path) -> None:
    """Probability as a line, truth as shade, whose track it was below."""
    seconds = link["time_ns"] * 1e-9
    person, access_point = link["person"].iloc[0], link["access_point"].iloc[0]
    figure, (above, below) = plt.subplots(
        2, 1, figsize=(9, 4.2), sharex=True, height_ratios=[4, 1], layout="constrained"
    )
    truth = blocked_within(link, WINDOW_STEPS).fillna(False).astype(bool)
    above.fill_between(
        seconds, 0, truth.astype(float), step="mid", color="tab:red", alpha=0.25, linewidth=0,
        label=f"truth: blocked within {100 * WINDOW_STEPS} ms",
    )
    above.plot(seconds, link[f"p_w{WINDOW_STEPS}"], color="tab:blue", label=f"p_w{WINDOW_STEPS} of the person's track")
    above.set(ylabel="probability", ylim=(-0.02, 1.02), title=f"Person {person}, access point {access_point}")
    above.legend(loc="upper center", bbox_to_anchor=(0.5, -0.02), ncols=2, frameon=False)
    known = link.dropna(subset=["track"])
    tracks = known["track"].astype("int64").astype(str)
    below.plot(known["time_ns"] * 1e-9, tracks, ".", color="black", markersize=3)
    below.set(xlabel="time, s", ylabel="track")
    below.margins(y=0.5)
    figure.savefig(picture, dpi=120)


def main(arguments: list[str]) -> None:
    if len(arguments) < 4:
        sys.exit(__doc__)
    run, truth, matches, picture = map(Path, arguments[:4])
    person = int(arguments[4]) if len(arguments) > 4 else None
    access_point = arguments[5] if len(arguments) > 5 else None
    scene = int(arguments[6]) if len(arguments) > 6 else 0
    link = one_link(joined(run, truth, matches), person, access_point, scene)
    plot(link, picture)
    known = link.dropna(subset=["p_now"])
    print(f"{picture}: {len(link)} frames, {len(known)} of them with a track, blocked in {link['blocked'].mean():.0%}")


if __name__ == "__main__":
    main(sys.argv[1:])
