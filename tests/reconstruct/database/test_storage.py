"""A database on disk: the same bytes back, and a word on everything that is not one."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.errors import BadFile
from harness.reconstruct.database.frames import TakeSegment
from harness.reconstruct.database.motion_database import MotionDatabase
from tests.core.leftovers import leave_behind


@pytest.fixture
def database(rng: np.random.Generator) -> MotionDatabase:
    runs = TakeSegment("a", "p1", "here", "walking", 0, 30), TakeSegment("b", "p2", "here", "boxing", 30, 50, 7)
    return MotionDatabase(
        40.0, rng.normal(size=(50, 52)).astype(np.float32), rng.normal(size=(50, 3)).astype(np.float32), runs
    )


@pytest.fixture
def saved(database: MotionDatabase, tmp_path: Path) -> Path:
    database.save(tmp_path / "some" / "database")
    return tmp_path / "some" / "database"


def test_it_comes_back_as_it_was_and_stays_on_disk(database: MotionDatabase, saved: Path) -> None:
    other = MotionDatabase.open(saved)
    assert isinstance(other.posture, np.memmap)
    np.testing.assert_array_equal(other.posture, database.posture)
    np.testing.assert_array_equal(other.step, database.step)
    assert (other.rate_hz, other.segments) == (40.0, database.segments)
    with pytest.raises(ValueError, match="read-only"):
        other.posture[0, 0] = 1.0
    assert sorted(path.name for path in saved.parent.iterdir()) == ["database"]


def test_the_same_database_gives_the_same_bytes(database: MotionDatabase, saved: Path, tmp_path: Path) -> None:
    database.save(tmp_path / "again")
    for path in saved.iterdir():
        assert path.read_bytes() == (tmp_path / "again" / path.name).read_bytes()


def test_what_a_killed_writer_left_is_removed_by_the_next(database: MotionDatabase, tmp_path: Path) -> None:
    left = leave_behind(tmp_path / "some" / "database", folder=True)
    assert left.is_dir()
    database.save(tmp_path / "some" / "database")
    assert [path.name for path in left.parent.iterdir()] == ["database"]


def test_nothing_is_overwritten(database: MotionDatabase, saved: Path) -> None:
    before = {path: path.read_bytes() for path in saved.iterdir()}
    with pytest.raises(BadFile, match="exists already"):
        database.save(saved)
    assert {path: path.read_bytes() for path in saved.iterdir()} == before
    empty = saved.parent / "empty"
    empty.mkdir()
    with pytest.raises(BadFile, match="exists already"):
        database.save(empty)


def test_a_write_that_fails_leaves_nothing(database: MotionDatabase, tmp_path: Path) -> None:
    unsaid: Any = None  # a run that cannot be written, after some that can
    cut = MotionDatabase(40.0, database.posture, database.step, (*database.segments, unsaid))
    with pytest.raises(AttributeError):
        cut.save(tmp_path / "database")
    assert list(tmp_path.iterdir()) == []


def card(folder: Path, **changes: Any) -> None:
    path = folder / "database.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def run(**changes: Any) -> dict[str, Any]:
    entry = {"take": "a", "subject": "", "source": "", "behaviour": "", "start": 0, "stop": 50, "first_frame": 0}
    return entry | changes


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"format": "a song"}, "not a motion database"),
        ({"version": 2}, "version 2; expected .* version 1"),
        ({"rate_hz": 0}, "a rate of 0"),
        ({"rate_hz": "forty"}, "a rate of 'forty'"),
        ({"runs": []}, "no runs"),
        ({"runs": 3}, "no runs"),
        ({"runs": [run(), 5]}, "run 1 is 5"),
        ({"runs": [run(start=1)]}, "run 0 has rows 1 to 50"),
        ({"runs": [run(stop=0)]}, "run 0 has rows 0 to 0"),
        ({"runs": [run(stop=30), run(start=31)]}, "run 1 has rows 31 to 50"),
        ({"runs": [run(stop=True)]}, "fields of the wrong type"),
        ({"runs": [run(first_frame=-1)]}, "runs that follow each other"),
        ({"runs": [run(stop=60)]}, "50 x 52 float32; expected an array of 60 x 52"),
    ],
)
def test_a_card_that_lies_is_refused(saved: Path, changes: dict[str, Any], found: str) -> None:
    card(saved, **changes)
    with pytest.raises(BadFile, match=found) as refused:
        MotionDatabase.open(saved)
    assert str(saved) in str(refused.value)


def test_missing_and_damaged_files_are_refused(saved: Path) -> None:
    with pytest.raises(BadFile, match=r"database\.json: no such file"):
        MotionDatabase.open(saved.parent)
    whole = (saved / "step.npy").read_bytes()
    for damaged in (b"", whole[:50], whole[:-1], b"x" + whole[1:]):
        (saved / "step.npy").write_bytes(damaged)
        with pytest.raises(BadFile, match=r"step\.npy"):
            MotionDatabase.open(saved)
    (saved / "step.npy").unlink()
    with pytest.raises(BadFile, match=r"step\.npy: no such file"):
        MotionDatabase.open(saved)
    (saved / "database.json").write_text("{")
    with pytest.raises(BadFile, match="not JSON"):
        MotionDatabase.open(saved)


def test_arrays_of_other_kinds_are_refused(saved: Path) -> None:
    np.save(saved / "step.npy", np.zeros((50, 3)))
    with pytest.raises(BadFile, match="50 x 3 float64; expected an array of 50 x 3 float32"):
        MotionDatabase.open(saved)
    objects = np.array([{"a": 1}], dtype=object)
    np.save(saved / "step.npy", objects, allow_pickle=True)  # a file that could do anything to whoever unpickles it
    with pytest.raises(BadFile, match="damaged"):
        MotionDatabase.open(saved)


def test_what_was_let_go_is_read_again(saved: Path) -> None:
    mapped = MotionDatabase.open(saved)
    before = np.array(mapped.posture), np.array(mapped.step)
    mapped.release_memory()
    np.testing.assert_array_equal(mapped.posture, before[0])
    np.testing.assert_array_equal(mapped.step, before[1])
