"""Atomic writers and the readers of JSON and TOML."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.core import files
from harness.errors import BadFile
from tests.core.leftovers import dead_process


def test_a_writer_replaces_a_file_and_leaves_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    files.write_text(path, "old\r\n")
    files.write_bytes(path, b"new")
    files.write_npz(tmp_path / "b", x=np.arange(3))
    assert path.read_bytes() == b"new"
    assert np.load(tmp_path / "b")["x"].tolist() == [0, 1, 2]
    assert {entry.name for entry in tmp_path.iterdir()} == {"a.txt", "b"}


def test_a_failed_write_keeps_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    files.write_text(path, "old")

    def fail() -> str:
        raise RuntimeError

    parts: list[Callable[[], str]] = [lambda: "half", fail]
    with pytest.raises(RuntimeError):
        files.write_parts(path, (part() for part in parts))
    assert path.read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.txt"]


def test_a_file_and_its_folder_are_flushed_before_anybody_relies_on_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[tuple[str, bool]] = []
    path = tmp_path / "a.txt"
    monkeypatch.setattr(files, "flush", lambda flushed: seen.append((flushed.name, path.exists())))
    files.write_text(path, "text")
    assert seen == [(files.temporary_path(tmp_path / "a.txt").name, False), (tmp_path.name, True)]


KILLED = """
import os, sys
from pathlib import Path
from harness.core.files import temporary_path
temporary_path(Path(sys.argv[1])).write_text("half")
print(flush=True)
sys.stdin.read()
"""


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="Windows cannot be asked whether a process lives")
def test_a_writer_removes_what_dead_processes_left_and_nothing_of_living_ones(tmp_path: Path) -> None:
    path = tmp_path / "a[1].txt"
    (tmp_path / f"{files.TEMPORARY}other-a[1].txt").write_text("of nobody known")
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", KILLED, str(path)], stdin=pipe, stdout=pipe) as process:
        assert process.stdout is not None
        process.stdout.readline()
        files.write_text(path, "one")
        assert len(list(tmp_path.iterdir())) == 3
        process.kill()
    files.write_text(path, "two")
    assert {entry.name for entry in tmp_path.iterdir()} == {path.name, f"{files.TEMPORARY}other-a[1].txt"}


@pytest.mark.skipif(os.name == "nt", reason="Windows cannot be asked whether a process lives")
@pytest.mark.parametrize("kind", ["file", "folder"])
def test_what_a_killed_process_left_goes_at_once_or_after_a_day(tmp_path: Path, kind: str) -> None:
    """The name of the same target goes at once, any other and one of version 23b301b7 a day later, others never."""
    dead = dead_process()
    here = files.temporary_path(tmp_path / "NAME").name.replace(f"{os.getpid()}-NAME", f"{dead}-")
    old, other = f"{files.TEMPORARY}{dead}-", here.replace(files.TEMPORARY, f"{files.TEMPORARY}0")
    at_once, after_a_day = [f"{here}a.bvh"], [f"{here}b.bvh", f"{old}a.bvh", f"{old}b.bvh"]
    never = [f"{other}a.bvh", f"{files.TEMPORARY}a.bvh", files.temporary_path(tmp_path / "c.bvh").name]
    for name in (*at_once, *after_a_day, *never):
        (tmp_path / name).touch() if kind == "file" else (tmp_path / name).mkdir()

    def left() -> set[str]:
        return {path.name for path in tmp_path.iterdir()}

    files.remove_leftovers(tmp_path / "a.bvh")
    assert left() == {*after_a_day, *never}
    for path in tmp_path.iterdir():
        os.utime(path, (0.0, 0.0))
    files.remove_leftovers(tmp_path / "a.bvh")
    assert left() == set(never)


def test_a_folder_moves_where_nothing_is(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").touch()
    with pytest.raises(OSError, match="empty"):
        files.move_into_place(tmp_path / "one", tmp_path / "two")
    files.move_into_place(tmp_path / "one", tmp_path / "three")
    assert (tmp_path / "three" / "file").exists()


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        (b"a = ", "not TOML: Invalid value"),
        (b"a = \xff", "not TOML: byte 5 is not UTF-8"),
        (b"a = " + 10_000 * b"[", "not TOML: "),
        (b"#" * (files.MAX_TOML_BYTES + 1), "1,048,577 bytes; expected a scenario of at most 1,048,576 bytes"),
    ],
)
def test_what_is_no_toml_is_refused_in_a_line(data: bytes, complaint: str, tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_bytes(data)
    with pytest.raises(BadFile) as refused:
        files.read_toml(path, "a scenario", "Write one.")
    assert complaint in str(refused.value)
    assert "\n" not in str(refused.value)


def test_no_file_is_refused_too(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="no such file"):
        files.read_toml(tmp_path / "a.toml", "a scenario", "Write one.")


def test_a_digest_is_the_same_on_another_processor(rng: np.random.Generator) -> None:
    """Processors differ by less than 1e-14; rounded decimals, such as typed bone lengths, are not at an edge."""
    values = np.append(rng.normal(scale=2.0, size=200_000), np.round(rng.normal(size=200_000), 6))
    other = values + rng.uniform(-1e-14, 1e-14, len(values))
    assert np.any(other != values)
    assert files.digest(other) == files.digest(values)
    assert files.digest(np.array([-0.0, np.nan])) == files.digest(np.array([0.0, np.nan]))


def test_a_digest_notices_a_change_of_one_value(rng: np.random.Generator) -> None:
    values = rng.normal(size=(100, 3))
    changed = values.copy()
    changed[57, 1] += 1.1e-5
    assert files.digest(changed) != files.digest(values)
    assert files.digest(values.reshape(300)) != files.digest(values)


def test_files_are_flushed_together_and_a_fault_is_raised(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    descriptors: list[int] = []
    monkeypatch.setattr(os, "fsync", descriptors.append)
    paths = [tmp_path / "a", tmp_path / "b"]
    paths[0].touch()
    with pytest.raises(FileNotFoundError):
        files.flush_together(iter(paths))
    paths[1].touch()
    descriptors.clear()
    files.flush_together(iter(paths))
    assert len(descriptors) == 2
