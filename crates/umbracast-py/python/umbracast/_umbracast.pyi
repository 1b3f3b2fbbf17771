"""What the compiled library has; `tests/test_package.py` compares the two."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, Protocol, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

Path: TypeAlias = str | PathLike[str]
Mode: TypeAlias = Literal["hdl", "paper", "default"]
Preset: TypeAlias = Literal["orca-03", "orca-06", "mixed", "natural", "pairs"]
Packet: TypeAlias = tuple[int, int, bytes]

class Columns(Protocol):
    """Columns by name: a `dict` of arrays, or a data frame."""

    def __getitem__(self, name: Any, /) -> Any: ...

Tables: TypeAlias = Mapping[str, Any]

__version__: str

@final
class Table:
    def __len__(self) -> int: ...
    def __contains__(self, name: str, /) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...
    def __getitem__(self, name: str, /) -> NDArray[Any]: ...
    def keys(self) -> list[str]: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...
    def __arrow_c_schema__(self) -> object: ...

@final
class Site:
    def __new__(cls, path: Path | None = None) -> Site: ...
    @staticmethod
    def from_toml(text: str) -> Site: ...
    @property
    def name(self) -> str: ...
    @property
    def access_points(self) -> list[str]: ...
    @property
    def sensors(self) -> list[str]: ...
    def to_toml(self, mode: Mode = "default") -> str: ...

@final
class Frame:
    @property
    def index(self) -> int: ...
    @property
    def time_ns(self) -> int: ...
    @property
    def points(self) -> NDArray[np.float64]: ...
    @property
    def sensors(self) -> NDArray[np.uint32]: ...
    @property
    def times_ns(self) -> NDArray[np.int64]: ...

@final
class Frames:
    def __iter__(self) -> Frames: ...
    def __next__(self) -> Frame: ...

@final
class Recording:
    def __iter__(self) -> Frames: ...
    @property
    def site(self) -> Site: ...
    @property
    def scene(self) -> int: ...
    @property
    def empty(self) -> list[Frame]: ...

@final
class Scene:
    @property
    def people(self) -> Table: ...
    @property
    def people_links(self) -> Table: ...
    @property
    def frames(self) -> list[Frame]: ...
    @property
    def empty(self) -> list[Frame]: ...
    def packets(self) -> list[Packet]: ...
    @property
    def site(self) -> Site: ...
    @property
    def scene(self) -> int: ...
    @property
    def seed(self) -> int: ...

@final
class Outcome:
    @property
    def frame(self) -> int: ...
    @property
    def time_ns(self) -> int: ...
    @property
    def detections(self) -> Table: ...
    @property
    def tracks(self) -> Table: ...
    @property
    def links(self) -> Table: ...
    @property
    def links_db(self) -> Table: ...
    @property
    def bindings(self) -> Table: ...
    @property
    def decisions(self) -> Table: ...
    @property
    def foreground(self) -> NDArray[np.float64]: ...
    @property
    def health(self) -> dict[str, int]: ...

@final
class Pipeline:
    def __new__(
        cls,
        site: Site | Path | None = None,
        *,
        mode: Mode = "default",
        weights: Path | None = None,
        scene: int = 0,
        threads: int = 1,
    ) -> Pipeline: ...
    def learn(self, frames: Iterable[Frame]) -> None: ...
    def hear(self, reports: Sequence[tuple[int, str, int, float] | tuple[int, str, int, float, bool]]) -> None: ...
    def step(self, points: Frame | ArrayLike | Sequence[ArrayLike], *, time_ns: int | None = None) -> Outcome: ...
    def feed(self, packets: Sequence[Packet]) -> list[Outcome]: ...
    def finish(self) -> list[Outcome]: ...
    def run(self, frames: Iterable[Frame]) -> Outcome: ...
    @property
    def site(self) -> Site: ...

@final
class Scores:
    def to_dict(self) -> dict[str, Any]: ...
    def value(
        self,
        score: str = "f1",
        *,
        access_point: str | None = None,
        window: int = 3,
        predictor: str = "run",
    ) -> float | None: ...

def simulate(
    site: Site | Path | None = None,
    *,
    preset: Preset = "orca-03",
    people: int = 10,
    seed: int = 200000,
    scene: int = 0,
    sensors: bool = True,
    seconds: float | None = None,
) -> Scene: ...
def read(path: Path | Sequence[Path], site: Site | Path | None = None) -> Recording: ...
def cast(
    tracks: Table | Outcome | Columns | Path,
    site: Site | Path | None = None,
    *,
    mode: Mode = "default",
    weights: Path | None = None,
) -> Outcome: ...
def forecast(
    tracks: Table | Outcome | Columns | Path,
    site: Site | Path | None = None,
    *,
    mode: Mode = "default",
    weights: Path | None = None,
) -> Table: ...
def decide(
    tracks: Table | Outcome | Columns | Path,
    site: Site | Path | None = None,
    *,
    mode: Mode = "default",
    weights: Path | None = None,
) -> Table: ...
def loss_db(
    access_point: Sequence[float],
    device: Sequence[float],
    bodies: Sequence[Sequence[float]],
    *,
    height_m: float = 1.72,
    width_m: float = 0.56,
    carrier_ghz: float = 28.0,
    model: Literal["kirchhoff", "model-b", "knife-edges", "three-edges"] = "kirchhoff",
) -> NDArray[np.float64]: ...
def evaluate(
    run: Outcome | Tables | Path | Sequence[Outcome | Tables],
    truth: Scene | Tables | Path | Sequence[Scene | Tables],
    *,
    site: Site | Path | None = None,
    mode: Mode = "default",
    weights: Path | None = None,
) -> Scores: ...
def matches(
    run: Outcome | Tables | Path | Sequence[Outcome | Tables],
    truth: Scene | Tables | Path | Sequence[Scene | Tables],
    *,
    site: Site | Path | None = None,
) -> Table: ...
def coverage(
    site: Site | Path | None = None,
    *,
    step_m: float = 0.5,
    height_m: float = 1.72,
    headings: int = 6,
) -> Table: ...
def calibrate(recording: Recording, site: Site | Path | None = None) -> dict[str, Any]: ...
