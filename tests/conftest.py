"""Fixtures that every test may use."""

import os
import signal
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

from harness.core.seeds import generator

for number in (signal.SIGINT, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else [])):
    if signal.getsignal(number) is signal.SIG_IGN:  # started in the background: tests that send signals need them
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)

pytest_plugins = ["tests.command", "tests.products", "tests.planted", "tests.scored_run"]

settings.register_profile("fixed", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("fixed")
"""The same examples in every run, so that a change is judged by what it changed, and no limit of time, so that a busy
machine fails nothing. `--hypothesis-profile=default`, as `make test-slow` has it, seeks new ones."""


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    """A generator that is seeded by the name of the test, so that moving a file changes no draw."""
    return generator(1, request.node.name)


@pytest.fixture(scope="session")
def mocap() -> Path:
    """The folder of real clips, from HARNESS_MOCAP."""
    folder = os.environ.get("HARNESS_MOCAP")
    if not folder:
        pytest.skip("no real motion: set HARNESS_MOCAP to a folder with CMU clips")
    assert Path(folder).is_dir(), f"HARNESS_MOCAP={folder} is not a folder"
    return Path(folder)


@pytest.fixture(scope="session")
def real() -> Path:
    """The folder of real streams of 6-DOF trackers, from HARNESS_REAL."""
    folder = os.environ.get("HARNESS_REAL")
    if not folder:
        pytest.skip("no real streams: set HARNESS_REAL to a folder with hand_eye/ and polhemus/")
    assert Path(folder).is_dir(), f"HARNESS_REAL={folder} is not a folder"
    return Path(folder)
