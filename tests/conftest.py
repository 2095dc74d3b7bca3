"""Fixtures that every test may use."""

import os
from pathlib import Path

import numpy as np
import pytest

from harness.core.seeds import generator


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    """A generator of this test's own, the same in every run."""
    return generator(1, request.node.nodeid)


@pytest.fixture(scope="session")
def mocap() -> Path:
    """The folder of real clips, from HARNESS_MOCAP."""
    folder = os.environ.get("HARNESS_MOCAP")
    if not folder:
        pytest.skip("no real motion: set HARNESS_MOCAP to a folder with CMU clips")
    assert Path(folder).is_dir(), f"HARNESS_MOCAP={folder} is not a folder"
    return Path(folder)
