"""Damaged files of every kind are read or refused in one line, in bounded time and memory."""

import os
import random
import shlex
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import pytest

from harness.cli import main
from harness.errors import BadFile, HarnessError
from tests.fuzz.campaign import changed_data, files_of, run_cases
from tests.fuzz.kinds import KINDS

SEED = 1
FEW, MANY = 720, 10_000
"""Numbers of files of all kinds."""


def _kind_folder(name: str, tmp_path: Path) -> Path:
    folder = tmp_path / "files"
    folder.mkdir()
    return folder


def _assert_no_findings(name: str, folder: Path, files: int) -> None:
    cases = list(run_cases(KINDS[name], folder, SEED, range(files_of(name, files))))
    findings = [f"case {case.number}: {case.text}" for case in cases if case.outcome == "finding"]
    assert not findings, "\n".join(findings)
    if len(cases) > 10:  # else the changes missed their aim
        assert {case.outcome for case in cases} == {"accepted", "refused"}


@pytest.mark.parametrize("name", KINDS)
def test_a_damaged_file_is_read_or_refused(name: str, tmp_path: Path) -> None:
    _assert_no_findings(name, _kind_folder(name, tmp_path), FEW)


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_ten_thousand_damaged_files_are_read_or_refused(name: str, tmp_path: Path) -> None:
    _assert_no_findings(name, _kind_folder(name, tmp_path), MANY)


def _make_fifo(path: Path) -> None:
    os.mkfifo(path)


def _make_socket(path: Path) -> None:
    here = os.getcwd()
    os.chdir(path.parent)  # names of sockets are short
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(path.name)
    os.chdir(here)


def _make_giant(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(2**42)


SPECIAL: dict[str, tuple[Callable[[Path], None], str]] = {
    "FIFO": (_make_fifo, "a FIFO, not a regular file"),
    "socket": (_make_socket, "a socket, not a regular file"),
    "folder": (Path.mkdir, "a folder, not a regular file"),
    "device": (lambda path: path.symlink_to("/dev/zero"), "a device, not a regular file"),
    "sparse giant": (_make_giant, "a file of 4,398,046,511,104 bytes; expected "),
}
READ_WHOLE = sorted(KINDS.keys() - {"method options", "run page"})
"""Kinds that are read from the file that the fuzzer changes."""


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    def stop(number: int, frame: FrameType | None) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no FIFOs")
@pytest.mark.parametrize("name", READ_WHOLE)
def test_what_is_no_file_or_too_large_is_refused_before_it_is_read(name: str, tmp_path: Path) -> None:
    folder, kind = _kind_folder(name, tmp_path), KINDS[name]
    kind.make(folder)
    target = sorted(folder.glob(kind.targets[0]))[0]
    for make, message in SPECIAL.values():
        target.rename(tmp_path / "aside")
        make(target)
        with _time_limit(20.0), pytest.raises(BadFile) as refused:
            kind.read(folder)
        assert str(target.name) in str(refused.value)
        assert message in str(refused.value)
        if target.is_dir():
            target.rmdir()
        else:
            target.unlink()
        (tmp_path / "aside").rename(target)
    kind.read(folder)


@pytest.mark.parametrize("name", [name for name in KINDS if KINDS[name].words])
def test_the_command_line_ends_with_a_word_after_a_damaged_file(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, kind = _kind_folder(name, tmp_path), KINDS[name]
    kind.make(folder)
    target = sorted(folder.glob(kind.targets[0]))[0]
    sound = target.read_bytes()
    for number in range(3 if kind.share == 1.0 else 1):
        target.write_bytes(changed_data(kind, sound, random.Random(f"words {number}")))  # noqa: S311
        with _time_limit(120.0):
            code = main(shlex.split(kind.words.format(folder)))
        said = capsys.readouterr()
        assert code in (0, 2, 3, 4)
        if code == 2:
            assert len(said.err.strip().splitlines()[-1]) < 2100
            assert said.out.strip().splitlines()[-1] == "refused"


def test_the_fuzzer_finds_what_it_looks_for(tmp_path: Path) -> None:
    def read(folder: Path) -> object:
        data = (folder / "x").read_bytes()
        if len(data) < 4:
            raise KeyError("x")
        if data[0] & 1:
            raise HarnessError("two\nlines")
        return data

    kind = KINDS["bvh"]
    odd = type(kind)("odd", lambda folder: (folder / "x").write_bytes(b"2345678"), ("x",), kind.changes, read)
    texts = [case.text for case in run_cases(odd, tmp_path, SEED, range(200)) if case.outcome == "finding"]
    assert any("KeyError" in text for text in texts)
    assert any("not one printable line" in text for text in texts)
