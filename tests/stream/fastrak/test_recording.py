"""Recordings of a FASTRAK: the format names the family, and the host's clock gives the times."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadFile
from harness.stream.fastrak.driver import FastrakConfig
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.recording.blocks import CONFIGURED, RECEIVED, encode_block, read_blocks
from harness.stream.recording.recording import read_recording
from harness.stream.recording.recording_writer import RecordingWriter
from harness.stream.recording.replay import RecordingStream
from harness.stream.recording.station_readings import CaptureReader, arrival_times_s
from tests.stream.fastrak.bench import fastrak_bench, open_fastrak
from tests.stream.is900.driver.bench import device_of, frames_for


def record(path: Path, binary: bool = True) -> None:
    bench = fastrak_bench(rate_hz=40.0)
    with RecordingWriter(path) as writer:
        writer_frames = open_fastrak(bench, FastrakConfig(stations=("a", "b", "c"), binary=binary), writer)
        with writer_frames as driver:
            frames_for(driver, bench, 3.0)
            assert device_of(bench).streaming


@pytest.mark.parametrize("binary", [True, False])
def test_a_replay_decodes_the_family(tmp_path: Path, binary: bool) -> None:
    record(tmp_path / "one.rec", binary=binary)
    stream = RecordingStream(tmp_path / "one.rec")
    frames = list(stream)
    assert (stream.wire.family, stream.wire.items, stream.stations) == ("fastrak", (2, 11, 1), ("a", "b", "c"))
    assert len(frames) == pytest.approx(120, abs=3)
    assert all(frame.position_valid.all() and not frame.suspect.any() for frame in frames)


def test_an_is900_has_the_format_of_earlier_versions(tmp_path: Path) -> None:
    """They refuse a key that they do not know, so that none reads a FASTRAK as an IS-900."""
    keys = {}
    for family in ("is900", "fastrak"):
        path = tmp_path / f"{family}.rec"
        with RecordingWriter(path) as writer:
            writer.on_configured(WireFormat(("a",), 60.0, (2, 11, 1), family=family))
        (block,) = [block for block in read_recording(path).blocks() if block.kind == CONFIGURED]
        keys[family] = json.loads(block.payload)
        assert read_recording(path).formats[0].family == family
    assert "family" not in keys["is900"]
    assert keys["fastrak"]["family"] == "fastrak"


def test_an_unknown_family_is_refused(tmp_path: Path) -> None:
    record(tmp_path / "one.rec")
    data = (tmp_path / "one.rec").read_bytes()
    blocks = [block for block in read_blocks(data) if not hasattr(block, "begin")]
    changed = [
        replace(block, payload=block.payload.replace(b'"fastrak"', b'"liberty"')) if block.kind == CONFIGURED else block
        for block in blocks
    ]
    (tmp_path / "two.rec").write_bytes(data[:16] + b"".join(map(encode_block, changed)))
    with pytest.raises(BadFile, match=r"unusable wire format .*liberty"):
        RecordingStream(tmp_path / "two.rec")


def test_readings_have_the_hosts_time(tmp_path: Path) -> None:
    record(tmp_path / "one.rec")
    received = [block for block in read_recording(tmp_path / "one.rec").blocks() if block.kind == RECEIVED]
    (block,) = CaptureReader(tmp_path / "one.rec").blocks()
    for readings in block.stations.values():
        assert np.isnan(readings.stamp_s).all()
        assert np.all(np.abs(np.diff(readings.measured_s) - 0.025) < 1e-3)
        assert received[0].monotonic_s < readings.measured_s[0] < readings.measured_s[-1] <= received[-1].monotonic_s


def test_late_reading_does_not_move_a_record() -> None:
    rng = np.random.default_rng(3)
    sent_s = 1e5 + np.arange(3000) / 60.0
    late_s = np.where(rng.random(3000) < 0.03, rng.uniform(0.0, 0.08, 3000), 0.0)
    received_s = np.maximum.accumulate(sent_s + late_s)
    times_s = arrival_times_s(received_s, 1.0 / 60.0)
    assert np.all(np.diff(times_s) > 0.0)
    assert np.abs(times_s - sent_s)[:-15].max() < 1e-6, "the last records have none after them"
    assert np.abs(received_s - sent_s).max() > 0.07


def test_gaps_stay_and_clocks_may_differ() -> None:
    """A device that is 0.1 % fast, and a second without a record."""
    sent_s = np.arange(600) / 60.06 + np.where(np.arange(600) < 300, 0.0, 1.0)
    times_s = arrival_times_s(sent_s, 1.0 / 60.0)
    assert np.all(np.diff(times_s) > 0.0)
    assert np.abs(times_s - sent_s).max() < 3e-4
    assert len(arrival_times_s(np.zeros(0), 0.01)) == 0
