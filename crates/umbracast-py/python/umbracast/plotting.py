"""One link over time, beside its truth. Needs matplotlib, which is imported when it is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._umbracast import Outcome, Scene, Table, matches

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEP_NS = 100_000_000


def plot(
    run: Outcome,
    truth: Scene | None = None,
    *,
    person: int | None = None,
    track: int | None = None,
    access_point: str | None = None,
    window: int = 3,
    ax: Axes | None = None,
) -> Axes:
    """The probability that a link is blocked within `window` steps of 100 ms, as a line over seconds.

    With a truth the link is a person's, and a shade shows when another body blocks it in truth within the window. The person is
    the one whose link is blocked the most where none is named. Without a truth the link is a track's: `track`, or the longest one.
    Gives matplotlib's axes.
    """
    import numpy as np

    if not 1 <= window <= 9:
        raise ValueError(f"window: expected 1 to 9 steps, found {window}")
    if ax is None:
        try:
            import matplotlib.pyplot as plt
        except ImportError as error:
            raise ValueError("plot: expected matplotlib, found none; `pip install matplotlib` brings it") from error
        _, ax = plt.subplots(figsize=(8, 2.6), layout="constrained")
    links = run.links
    if len(links) == 0:
        raise ValueError("run: expected links, found none")
    place = access_point if access_point is not None else str(links["access_point"][0])
    if truth is None:
        chosen = _longest(links, place) if track is None else track
        keep = (links["access_point"] == place) & (links["track"] == chosen)
        name = f"track {chosen}"
    else:
        chosen = _most_blocked(truth, place) if person is None else person
        pairs = matches(run, truth)
        own = pairs["person"] == chosen
        times = {int(t): int(k) for t, k in zip(pairs["time_ns"][own], pairs["track"][own])}
        here = links["access_point"] == place
        keep = here & np.array([times.get(int(t)) == int(k) for t, k in zip(links["time_ns"], links["track"])])
        name = f"person {chosen}"
        for begin_s, end_s in _spans(*_blocked_within(truth, place, chosen, window)):
            ax.axvspan(begin_s, end_s, color="0.85", label="_truth")
        ax.fill_between([], [], color="0.85", label="blocked in truth")
    seconds = links["time_ns"][keep] * 1e-9
    order = np.argsort(seconds)
    ax.plot(seconds[order], links[f"p_w{window}"][keep][order], label="probability")
    ax.set(ylim=(-0.02, 1.02), xlabel="s", ylabel=f"blocked within {100 * window} ms", title=f"{name}, access point {place}")
    ax.legend(loc="upper right")
    return ax


def _longest(links: Table, place: str) -> int:
    import numpy as np

    tracks = links["track"][links["access_point"] == place]
    if len(tracks) == 0:
        known = ", ".join(sorted(set(links["access_point"])))
        raise ValueError(f"access_point: expected one of {known}, found {place!r}")
    ids, counts = np.unique(tracks, return_counts=True)
    return int(ids[counts.argmax()])


def _most_blocked(truth: Scene, place: str) -> int:
    import numpy as np

    links = truth.people_links
    here = (links["access_point"] == place) & links["blocked"]
    if not (links["access_point"] == place).any():
        known = ", ".join(sorted(set(links["access_point"])))
        raise ValueError(f"access_point: expected one of {known}, found {place!r}")
    ids, counts = np.unique(links["person"][here], return_counts=True)
    return int(ids[counts.argmax()]) if len(ids) else int(links["person"][0])


def _blocked_within(truth: Scene, place: str, person: int, window: int) -> tuple[Any, Any]:
    """When (seconds), and whether the link is blocked in one of the next `window` frames."""
    import numpy as np

    links = truth.people_links
    own = (links["access_point"] == place) & (links["person"] == person)
    if not own.any():
        known = ", ".join(str(k) for k in sorted(set(links["person"].tolist())))
        raise ValueError(f"person: expected one of {known}, found {person}")
    blocked = {int(t): bool(b) for t, b in zip(links["time_ns"][own], links["blocked"][own])}
    times = np.array(sorted(blocked))
    soon = [any(blocked.get(int(t) + step * STEP_NS, False) for step in range(1, window + 1)) for t in times]
    return times * 1e-9, np.array(soon)


def _spans(seconds: Any, blocked: Any) -> list[tuple[float, float]]:
    spans: list[tuple[float, float]] = []
    half_s = 0.5e-9 * STEP_NS
    for at_s, is_blocked in zip(seconds, blocked):
        if not is_blocked:
            continue
        if spans and at_s - half_s <= spans[-1][1] + 1e-6:
            spans[-1] = (spans[-1][0], float(at_s + half_s))
        else:
            spans.append((float(at_s - half_s), float(at_s + half_s)))
    return spans
