"""All readings of one capture or pose log, read once: what `validate` relates to a reference."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.errors import BadFile, BadInput
from harness.measure import MeasuredPoses, mean_period_s
from harness.stream import PoseLog
from harness.stream.polhemus.codec import WireFormat
from harness.stream.recording import CaptureReader, PoseLogStream, RecordingStream, StationReadings


@dataclass(frozen=True, eq=False)
class CaptureReadings:
    """The longest session of a capture. The device's clock begins anew in each session."""

    path: Path
    note: Mapping[str, Any]
    """The latest note on the origin of the recording."""
    wire: WireFormat | None
    """Format of the device's records; None for a pose log, which has no device's records."""
    readings: Mapping[str, StationReadings]
    """Station -> its readings."""
    damage: tuple[str, ...]
    """Descriptions of the damaged or truncated parts of the file."""
    left_out: tuple[str, ...]
    """What the file has beside the readings, a sentence each."""
    log: PoseLog | None = None
    """The poses of a pose log; None for a device's records."""

    def frames(self) -> RecordingStream | PoseLogStream:
        """The capture as a stream; poses of a log within one mean period are one frame."""
        return PoseLogStream(self.log, period_s=1.0 / self.rate_hz) if self.log else RecordingStream(self.path)

    @property
    def stations(self) -> tuple[str, ...]:
        """Station names, in the order of the device's stations."""
        return self.wire.stations if self.wire else tuple(self.readings)

    @property
    def rate_hz(self) -> float:
        """Nominal rate of each station; of a pose log the inverse of its mean period [Hz]."""
        if self.wire:
            return self.wire.rate_hz
        return round(1.0 / mean_period_s([one.measured_s for one in self.readings.values()]), 3)

    def only(self, stations: Sequence[str]) -> "CaptureReadings":
        """The readings of some stations; BadInput for one that is not there."""
        for name in stations:
            if name not in self.readings:
                raise BadInput(f"No station {name!r} in {self.path.name}.", f"It has {', '.join(self.readings)}.")
        return replace(self, readings={name: self.readings[name] for name in stations})

    @property
    def duration_s(self) -> float:
        """Time from the first record of the session to its last, on the host's clock [s]."""
        received_s = np.concatenate([one.received_s for one in self.readings.values()])
        return float(received_s.max() - received_s.min()) if len(received_s) else 0.0


def read_capture(reader: CaptureReader) -> CaptureReadings:
    """Read the longest session of a capture; BadFile for a capture without a record."""
    blocks = [block for block in reader.blocks() if block.stations]
    if not blocks:
        raise BadFile(reader.path, "no record of a station", "a capture with readings", "Record it again.")
    records: dict[int, int] = {}
    for block in blocks:
        records[block.session] = records.get(block.session, 0) + block.records
    longest = max(records, key=lambda session: (records[session], -session))
    others = sum(records.values()) - records[longest]
    left_out = []
    if others:
        left_out.append(f"{others} records of {len(records) - 1} other session(s) of the device are left out.")
    if garbage := sum(block.garbage_bytes for block in blocks):
        left_out.append(f"{garbage} bytes belong to no record.")
    readings = {}
    for station in reader.wire.stations:
        parts = [block.stations[station] for block in blocks if block.session == longest]
        readings[station] = StationReadings.join(parts)
    return CaptureReadings(reader.path, dict(reader.note), reader.wire, readings, tuple(reader.damage), tuple(left_out))


def measured_poses(readings: StationReadings) -> MeasuredPoses:
    """The readings as poses for the registration."""
    valid = np.isfinite(readings.position_m[:, 0]) & np.isfinite(readings.tracker_from_station[:, 0])
    return MeasuredPoses(
        readings.measured_s, readings.position_m, readings.tracker_from_station, valid & ~readings.suspect
    )
