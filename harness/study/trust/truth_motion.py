"""Reference motion of a capture: poses of the bodies that carry the stations, from one of five sources."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from harness.body.kinematics import bone_poses
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.humanoid24 import BONES
from harness.errors import BadInput
from harness.experiment.playback import Playback
from harness.measure.pose_series import MeasuredPoses, TruthPoses
from harness.stream.recording.station_readings import CaptureReader, StationReadings


@dataclass(frozen=True)
class NominalMount:
    """Where a station is said to be on its body."""

    position_m: Floats
    """(3,) origin of the station in the frame of its body [m]."""
    body_from_station: Floats
    """(4,) unit quaternion."""


@dataclass(frozen=True, eq=False)
class TruthMotion:
    """Poses of the bodies of a reference over time."""

    title: str
    """The reference in words."""
    bodies: Mapping[str, TruthPoses]
    """Name of the body -> its poses."""
    body_of: Mapping[str, str]
    """Station -> name of the body that carries it."""
    nominal: Mapping[str, NominalMount] = field(default_factory=dict)
    """Station -> nominal mount, where one is stated."""
    host_clock: bool = False
    """Whether the reference's clock is the host's clock of the capture, so that latency shows."""
    playback: Playback | None = None
    """The motion of a scenario's performer, on which methods can be scored."""
    notes: tuple[str, ...] = ()
    """What to know about the reference, a sentence each."""


def truth_of_playback(playback: Playback, until_s: float, *, host_clock: bool) -> TruthMotion:
    """The bones of a performer whose motion a simulator or an emulator played, for `until_s` of device time [s].

    An emulator plays the take again and again; the way back to its beginning has no reference.
    """
    take, calibration = playback.take, playback.calibration
    position_m, world_from_bone = bone_poses(playback.body.skeleton, take.qpos)
    time_s = np.arange(len(take)) / take.rate_hz
    loops = 1
    if until_s > time_s[-1] + 1.0:
        loops = int(np.ceil(until_s / playback.samples.loop_s))
    begins_s = playback.samples.loop_s * np.arange(loops) if loops > 1 else np.zeros(1)
    times_s = (begins_s[:, None] + time_s).ravel()
    bodies = {}
    for bone in dict.fromkeys(calibration.bones):
        row = BONES.index(bone)
        place, turn = (np.tile(values[:, row], (loops, 1)) for values in (position_m, world_from_bone))
        bodies[bone] = TruthPoses(times_s, place, turn)
    clip = playback.clip_evaluation.part
    return TruthMotion(
        f"clip {clip} of the scenario {playback.scenario.name}, {time_s[-1]:.1f} s",
        bodies,
        dict(zip(calibration.stations, calibration.bones, strict=True)),
        nominal_mounts(calibration),
        host_clock,
        playback,
    )


def nominal_mounts(calibration: Calibration) -> dict[str, NominalMount]:
    """The mounts of a calibration by station."""
    mounts = zip(calibration.stations, calibration.mount_m, calibration.bone_from_station, strict=True)
    return {station: NominalMount(mount_m, turn) for station, mount_m, turn in mounts}


def truth_of_capture(path: Path, stations: Sequence[str]) -> TruthMotion:
    """Another capture as the reference: its stations are the bodies, those of the same name carry the stations.

    Times are those of its device's clock. BadFile, and BadInput without a common station.
    """
    reader = CaptureReader(path)
    bodies = {}
    for name, readings in read_stations(reader).items():
        poses = measured_poses(readings)
        rows = np.flatnonzero(poses.valid & np.isfinite(poses.measured_s))
        rows = rows[np.diff(poses.measured_s[rows], prepend=-np.inf) > 0.0]
        bodies[name] = TruthPoses(poses.measured_s[rows], poses.position_m[rows], poses.tracker_from_station[rows])
    return TruthMotion(f"the capture {path.name}", bodies, common_names(stations, bodies))


def common_names(stations: Sequence[str], bodies: Mapping[str, TruthPoses]) -> dict[str, str]:
    """Each station with the body of its name; BadInput unless every station has one."""
    missing = [name for name in stations if name not in bodies]
    if missing:
        raise BadInput(
            f"The reference has no body {missing[0]!r}; it has {', '.join(bodies) or 'none'}.",
            "Name its bodies as the stations of the capture.",
        )
    return {name: name for name in stations}


def read_stations(reader: CaptureReader) -> dict[str, StationReadings]:
    """All readings of a capture, station by station."""
    blocks = list(reader.blocks())
    names = StationReadings.__dataclass_fields__
    out = {}
    for station in reader.wire.stations:
        parts = [block.stations[station] for block in blocks if block.stations]
        columns = ([getattr(part, name) for part in parts] for name in names)
        if parts:
            out[station] = StationReadings(*(np.concatenate(column) for column in columns))
    return out


def measured_poses(readings: StationReadings) -> MeasuredPoses:
    """The readings as poses for the registration."""
    valid = np.isfinite(readings.position_m[:, 0]) & np.isfinite(readings.tracker_from_station[:, 0])
    return MeasuredPoses(
        readings.measured_s, readings.position_m, readings.tracker_from_station, valid & ~readings.suspect
    )
