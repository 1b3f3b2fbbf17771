"""LiDARs see people, their next second is forecast, and radio links that a body will block are told.

>>> import umbracast
>>> scene = umbracast.simulate(people=3, seed=200_000, seconds=2)
>>> pipeline = umbracast.Pipeline(scene.site)
>>> pipeline.learn(scene.empty)
>>> outcome = pipeline.run(scene.frames)
>>> sorted(set(outcome.links["access_point"].tolist()))
['centre', 'side']

Tables are columns by name, as `docs/CONVENTIONS.md` describes them. NumPy reads a column where it lies, and polars, pandas and pyarrow
read the whole table without a copy. Errors are `ValueError`, and say file, place, expected and found.
"""

from ._umbracast import (
    Frame,
    Frames,
    Outcome,
    Pipeline,
    Recording,
    Scene,
    Scores,
    Site,
    Table,
    __version__,
    calibrate,
    cast,
    coverage,
    decide,
    evaluate,
    forecast,
    loss_db,
    matches,
    read,
    simulate,
)
from .plotting import plot

__all__ = [
    "Frame",
    "Frames",
    "Outcome",
    "Pipeline",
    "Recording",
    "Scene",
    "Scores",
    "Site",
    "Table",
    "__version__",
    "calibrate",
    "cast",
    "coverage",
    "decide",
    "evaluate",
    "forecast",
    "loss_db",
    "matches",
    "plot",
    "read",
    "simulate",
]
