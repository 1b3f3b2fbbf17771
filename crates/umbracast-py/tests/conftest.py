"""What several tests look at: one short scene and what the pipeline says of it, and the command."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

import umbracast

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def scene():
    return umbracast.simulate(people=5, seconds=6)


@pytest.fixture(scope="session")
def outcome(scene):
    pipeline = umbracast.Pipeline(scene.site)
    pipeline.learn(scene.empty)
    return pipeline.run(scene.frames)


@pytest.fixture(scope="session")
def command():
    """Runs the command `umbracast`: that of `UMBRACAST`, of the build folder or of the path."""
    places = [os.environ.get("UMBRACAST"), ROOT / "target/debug/umbracast", ROOT / "target/release/umbracast"]
    found = next((str(place) for place in places if place and Path(place).exists()), shutil.which("umbracast"))
    if found is None:
        pytest.skip("no command `umbracast`: build it with `cargo build`")

    def run(*arguments):
        told = subprocess.run([found, *map(str, arguments)], capture_output=True, text=True)
        assert told.returncode == 0, told.stderr
        return told.stdout

    return run
