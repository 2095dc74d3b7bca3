"""The checks of results pass here, and each fails where what it checks is broken."""

from collections.abc import Callable
from typing import Any

import pytest

from harness.errors import Outcome
from harness.testing import results_checks


@pytest.fixture
def one_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorter runs."""
    monkeypatch.setattr(results_checks, "_SHORT_S", 1.5)


def verdicts() -> dict[str, bool]:
    return {name: ok for name, ok, _ in results_checks.check_results()}


def test_all_pass(one_run: None) -> None:
    assert all(verdicts().values())
    assert len(verdicts()) == 4


BREAKS: list[tuple[str, Callable[..., Any], str]] = [
    ("find_shared_motion", lambda *_: None, "a copy of a test clip"),
    ("load_run", lambda folder: type("Run", (), {"records": (1,)})(), "an edited result"),
    (
        "compare_runs",
        lambda *_, **__: type("Comparison", (), {"outcome": Outcome.REGRESSED})(),
        "two runs of the same code",
    ),
]


@pytest.mark.parametrize(("name", "broken", "noticed"), BREAKS)
def test_a_broken_part_is_noticed(
    one_run: None, monkeypatch: pytest.MonkeyPatch, name: str, broken: Callable[..., Any], noticed: str
) -> None:
    monkeypatch.setattr(results_checks, name, broken)
    failed = [check for check, ok in verdicts().items() if not ok]
    assert len(failed) == 1
    assert failed[0].startswith(noticed)
