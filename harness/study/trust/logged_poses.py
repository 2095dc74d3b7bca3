"""Pose logs of other programs as a capture to validate, and as its reference."""

from collections.abc import Sequence

import numpy as np

from harness.core import rotations
from harness.measure import TruthPoses, describe_sampling
from harness.stream import BodyPoses, PoseLog
from harness.stream.recording import PoseRecording, StationReadings
from harness.study.trust.capture_readings import CaptureReadings
from harness.study.trust.truth_motion import TruthMotion


def readings_of_poses(recording: PoseRecording) -> CaptureReadings:
    """The bodies of a file of poses as stations. The log's clock is both the device's and the host's."""
    log = recording.log
    note = {**recording.note, "source": "poses", "start_unix_s": log.start_unix_s}
    readings = {body.name: _readings(body) for body in log.bodies}
    return CaptureReadings(recording.path, note, None, readings, recording.damage, _sampling(log))


def _sampling(log: PoseLog) -> tuple[str, ...]:
    counted = log.clock if log.is_counted else ""
    return tuple(describe_sampling(body.name, body.times_s, counted) for body in log.bodies)


def _readings(body: BodyPoses) -> StationReadings:
    count = len(body.times_s)
    return StationReadings(
        body.times_s,
        body.times_s,
        body.times_s,
        body.positions_m,
        body.quaternions,
        np.ones(count),
        np.zeros(count, bool),
    )


def truth_of_log(log: PoseLog, stations: Sequence[str]) -> TruthMotion:
    """A pose log as the reference: bodies with the names of stations, or its only body for the only station."""
    bodies = {
        body.name: TruthPoses(body.times_s, body.positions_m, rotations.continuous(body.quaternions))
        for body in log.bodies
    }
    alone = len(stations) == len(bodies) == 1
    pairs = zip(stations, bodies, strict=True) if alone else ((name, name) for name in stations if name in bodies)
    return TruthMotion(
        f"the poses of {log.source}, {log.duration_s:.1f} s",
        bodies,
        dict(pairs),
        is_log=True,
        start_unix_s=log.start_unix_s,
        notes=tuple(f"Reference: {sentence}" for sentence in _sampling(log)),
    )
