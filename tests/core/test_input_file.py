"""Files from outside are read only if they are regular and no larger than their limit."""

import os
from pathlib import Path

import pytest

from harness.core.input_file import check_input_file, names_input_file, read_input_file
from harness.errors import BadFile

needs_fifo = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no FIFOs")


def test_a_file_of_the_limit_is_read_and_a_larger_one_is_not(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_bytes(b"12345")
    assert read_input_file(path, "a thing", 5) == b"12345"
    with pytest.raises(BadFile, match="a file of 5 bytes; expected a thing of at most 4 bytes"):
        read_input_file(path, "a thing", 4)


def test_the_size_of_a_sparse_file_counts(tmp_path: Path) -> None:
    with open(tmp_path / "x", "wb") as file:
        file.truncate(2**40)
    with pytest.raises(BadFile, match="a file of 1,099,511,627,776 bytes"):
        read_input_file(tmp_path / "x", "a thing", 1000)


@needs_fifo
def test_a_fifo_is_not_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "x")
    with pytest.raises(BadFile, match="a FIFO, not a regular file"):
        read_input_file(tmp_path / "x", "a thing", 1000)


@needs_fifo
def test_links_to_devices_and_folders_are_refused(tmp_path: Path) -> None:
    (tmp_path / "zero").symlink_to("/dev/zero")
    with pytest.raises(BadFile, match="a device, not a regular file"):
        check_input_file(tmp_path / "zero", "a thing", 1000)
    with pytest.raises(BadFile, match="a folder, not a regular file"):
        check_input_file(tmp_path, "a thing", 1000)


def test_names_that_no_file_can_have_are_refused(tmp_path: Path) -> None:
    for name in ("missing", "a\0b", "x" * 300):
        assert not names_input_file(tmp_path / name)
        with pytest.raises(BadFile) as refused:
            check_input_file(tmp_path / name, "a thing", 1000)
        assert str(refused.value).isprintable()
    assert not names_input_file(tmp_path)


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="this system has no /proc")
def test_a_file_that_hides_its_size_is_read_up_to_the_limit() -> None:
    with pytest.raises(BadFile, match="a file of more than 10 bytes"):
        read_input_file(Path("/proc/self/maps"), "a thing", 10)
