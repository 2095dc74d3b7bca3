"""Verbs that run until Ctrl-C: an interrupt before they did anything is `interrupted`, and nothing half done stays."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import pytest

from harness.commands.output import progress_note, recording_note
from harness.stream.polhemus.codec import WireFormat
from harness.stream.recording import RecordingStream, RecordingWriter, record_capture
from tests.command import Command
from tests.stream.wire import FOUR, device_bytes, in_chunks, stamps_s


def interrupt(*_: object, **__: object) -> NoReturn:
    raise KeyboardInterrupt


def test_a_simulated_recording_that_is_stopped_before_it_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    monkeypatch.setattr("harness.experiment.playback.prepare_playback", interrupt)
    path = tmp_path / "a.rec"
    said = command("record", "sim:demo", path, code=130)
    assert said.lines[-1] == "interrupted"
    assert f"Nothing was recorded into {path}" in said.err
    assert not path.exists()
    assert command("record", "sim:demo", path, "--json", code=130).content["outcome"] == "interrupted"


@pytest.mark.parametrize("existing", [False, True])
@pytest.mark.parametrize("calls", [0, 1, 3])
def test_a_simulated_recording_that_is_stopped_in_the_middle_leaves_the_file_as_it_was(
    calls: int, existing: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same command would append to a part otherwise."""
    path = tmp_path / "a.rec"
    stamp_s = stamps_s(200)
    capture = in_chunks(device_bytes(stamp_s), stamp_s)
    if existing:
        record_capture(path, FOUR, capture, {})
    before = path.read_bytes() if existing else None
    monkeypatch.setattr("harness.stream.recording.recording_writer._CHUNKS_PER_WRITE", 100)
    original, seen = RecordingWriter.on_simulated, list[int]()

    def stop_after(writer: RecordingWriter, chunks: Any) -> None:
        seen.append(len(chunks))
        if len(seen) > calls:
            raise KeyboardInterrupt
        original(writer, chunks)

    monkeypatch.setattr(RecordingWriter, "on_simulated", stop_after)
    with pytest.raises(KeyboardInterrupt):
        record_capture(path, FOUR, capture, {})
    assert len(seen) == calls + 1
    assert (path.read_bytes() if path.exists() else None) == before
    monkeypatch.setattr(RecordingWriter, "on_simulated", original)
    record_capture(path, FOUR, capture, {})
    assert len(list(RecordingStream(path))) == (2 if existing else 1) * 200


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("recorder.open_tracker_at", []),
        ("command_recording.detect_device", ["--send", "S"]),
        ("line_server.detect_device", ["--serve", "LINK"]),
    ],
)
def test_a_recording_of_a_device_that_is_stopped_before_the_device_was_set_up(
    name: str, options: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    command: Command) -> None:  # fmt: skip
    monkeypatch.setattr(f"harness.stream.recording.{name}", interrupt)
    path = tmp_path / "a.rec"
    words = [str(tmp_path / "link") if word == "LINK" else word for word in options]
    assert command("record", "tcp://127.0.0.1:9", path, *words, code=130).lines[-1] == "interrupted"
    assert not path.exists()


class _Device:
    """A device that is set up and sends nothing or something before Ctrl-C."""

    identification, station_list, setup_note, stations = "IS900", "1 head", "", ("head",)

    def __init__(self, writer: RecordingWriter, records: int) -> None:
        self.counts: Mapping[str, int] = {"frames": 0, "records": records, "out_of_range": 0}
        writer.on_configured(WireFormat(("head",), 40.0))

    def close(self) -> None: ...

    def __iter__(self) -> Iterator[NoReturn]:
        raise KeyboardInterrupt


@pytest.mark.parametrize(("records", "code"), [(0, 130), (1, 0)])
def test_a_recording_is_good_from_its_first_record_on(
    records: int, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    @contextmanager
    def opened(port: str, config: object, *, observer: RecordingWriter, on_event: object) -> Iterator[_Device]:
        yield _Device(observer, records)

    monkeypatch.setattr("harness.stream.recording.recorder.open_tracker_at", opened)
    said = command("record", "tcp://127.0.0.1:9", tmp_path / "a.rec", code=code)
    assert said.lines[-1] == ("pass" if records else "interrupted")


@pytest.mark.parametrize(
    "words", [["emulate", "demo", "--tcp", "127.0.0.1:0"], ["live", "--port", "x", "--scenario", "demo"]]
)
def test_emulate_and_live_that_are_stopped_while_they_prepare(
    words: list[str], monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    monkeypatch.setattr("harness.experiment.playback.prepare_playback", interrupt)
    said = command(*words, code=130)
    assert said.lines[-1] == "interrupted"
    assert "resumes" not in said.err


@pytest.mark.parametrize("recorded", [False, True])
def test_a_verb_says_that_it_resumes_only_where_it_does(recorded: bool, tmp_path: Path) -> None:
    """A folder of cells and a guided capture go on, where they were begun; other recordings do not."""
    path = tmp_path / "kept"
    for note, keeps in (
        (progress_note(path), "cells in .* kept, and the same command resumes"),
        (recording_note(path, ", and the same command resumes."), "kept in .*kept, and the same command resumes"),
        (recording_note(path), r"kept in .*kept\.$"),
    ):
        if recorded:
            path.mkdir(exist_ok=True)
        with pytest.raises(KeyboardInterrupt) as stopped, note:
            raise KeyboardInterrupt
        assert re.search(keeps if recorded else r"^Nothing .*kept\.$", stopped.value.__notes__[0])


def test_a_fault_says_what_is_kept_and_leaves_the_advice_to_its_cause(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="disk") as failed, progress_note(tmp_path):
        raise OSError("disk")
    assert failed.value.__notes__ == [f"The finished cells in {tmp_path} are kept."]


def test_a_discarded_recording_of_nothing_leaves_no_file(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "a.rec") as writer:
        writer.discard()
    assert not (tmp_path / "a.rec").exists()
    with RecordingWriter(tmp_path / "a.rec") as writer:
        writer.on_configured(FOUR)
        writer.on_simulated([(0.0, b"01 ")])
        writer.discard()
        writer.on_simulated([(1.0, b"01 ")])
    assert not (tmp_path / "a.rec").exists()
