"""A run with frames that several tests draw."""

from pathlib import Path

import pytest

from tests.planted import Plan, planted_run


@pytest.fixture(scope="session")
def framed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two clips with frames, four methods, each with twice the errors in the second condition."""
    plan = Plan(("walking",), takes=2, duration_s=3.0, vary={"noise": ["clean", "default"]})
    return planted_run(tmp_path_factory.mktemp("framed") / "run", plan)
