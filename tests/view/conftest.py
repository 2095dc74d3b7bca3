"""Fixtures of pages and pictures, shared with the tests of reports, and a run as `harness view` opens it."""

from pathlib import Path

import pytest

from harness.commands.viewed_motion import open_motion
from harness.view.page import ViewedMotion
from tests.report.conftest import browser, renders

__all__ = ["browser", "renders"]


@pytest.fixture(scope="session")
def motion(viewed: Path) -> ViewedMotion:
    """Two clips with the methods `map`, `ik` and `far`."""
    return open_motion(str(viewed), methods=None, mocap=None, rate_hz=None, playback={})
