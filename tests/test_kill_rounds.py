"""Commands that are stopped by signals at random moments leave nothing behind, say what they did, and go on later."""

import sys
from collections.abc import Iterator
from importlib.util import find_spec

import pytest

from tests.kill_rounds import KINDS, Work, kill_rounds, prepared_work

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="processes are found in /proc")


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Work]:
    with prepared_work(tmp_path_factory.mktemp("work")) as found:
        yield found


@pytest.fixture(scope="module")
def work_with_device(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Work]:
    with prepared_work(tmp_path_factory.mktemp("work"), device=True) as found:
        yield found


def assert_rounds(work: Work, kind: str, count: int, seed: int) -> None:
    rounds = list(kill_rounds(work, kind, count, seed))
    assert [f"{ended.stops}: {fault}" for ended in rounds for fault in ended.faults] == []
    assert len(rounds) >= count


@pytest.mark.parametrize("kind", ["run", "baseline"])
def test_a_command_that_is_stopped_ends_tidily(work: Work, kind: str) -> None:
    assert_rounds(work, kind, 2, seed=1)


@pytest.mark.long
@pytest.mark.parametrize(
    "kind",
    ["emulate", "record", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("report", "sweep"))],
)
def test_a_longer_command_that_is_stopped_ends_tidily(work_with_device: Work, kind: str) -> None:
    assert_rounds(work_with_device, kind, 1, seed=1)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_commands_that_are_stopped_at_random_end_tidily(work_with_device: Work, kind: str) -> None:
    if "dask" in kind and find_spec("distributed") is None:
        pytest.skip("no Dask: extra `cluster` is not installed")
    assert_rounds(work_with_device, kind, 10, seed=2)
