"""Pose logs of other programs as a capture to validate, and as its reference."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from harness.core import rotations
from harness.errors import BadInput
from harness.measure import TruthPoses, describe_sampling
from harness.stream import PoseFileOptions, PoseLog
from harness.stream.recording import CaptureReader, PoseRecording, StationReadings
from harness.study.trust.capture_readings import CaptureReadings, read_capture
from harness.study.trust.pose_source import holds_poses, read_poses
from harness.study.trust.truth_motion import TruthMotion, pair_names

_CONVENTIONS = ("body", "gaps", "untracked", "left out", "length unit", "quaternion order")
"""Findings about a reference that its results rest on."""
_FLAGS = {"length unit": "unit", "quaternion order": "quaternion"}
"""Finding -> option that replaces it."""


def open_capture(path: Path, options: PoseFileOptions | None = None) -> CaptureReadings:
    """The readings of a device's recording or of a file of poses; BadFile as `read_capture` and `read_poses`."""
    if holds_poses(path):
        return readings_of_poses(read_poses([path], options or PoseFileOptions()))
    if options not in (None, PoseFileOptions()):
        raise BadInput(f"--unit or the like with {path.name}.", "It is for poses of another program: leave it out.")
    return read_capture(CaptureReader(path))


def readings_of_poses(recording: PoseRecording) -> CaptureReadings:
    """The bodies of a file of poses as stations."""
    log = recording.log
    note = {**recording.note, "source": "poses", "start_unix_s": log.start_unix_s}
    readings = {body.name: StationReadings.of_body(body) for body in log.bodies}
    return CaptureReadings(recording.path, note, None, readings, recording.damage, _sampling(log), log)


def _sampling(log: PoseLog) -> tuple[str, ...]:
    counted = log.clock if log.is_counted else ""
    return tuple(describe_sampling(body.name, body.times_s, counted) for body in log.bodies)


def truth_of_log(
    log: PoseLog, stations: Sequence[str], noise: Mapping[str, tuple[float, float]] | None = None
) -> TruthMotion:
    """A pose log as the reference, with the noise of its bodies where it is known; BadInput as `pair_names`."""
    bodies = {
        body.name: TruthPoses(body.times_s, body.positions_m, rotations.continuous(body.quaternions))
        for body in log.bodies
    }
    concluded = (str(finding) for finding in log.findings if finding.subject.startswith(_CONVENTIONS))
    return TruthMotion(
        f"the poses of {log.source}, {log.duration_s:.1f} s",
        bodies,
        pair_names(stations, bodies),
        log=log,
        noise=noise or {},
        notes=(
            *(f"Reference: {sentence}" for sentence in (*_sampling(log), *concluded)),
            "Times of a file of poses count from its first pose.",
        ),
    )


def describe_doubts(capture: PoseLog | None, reference: PoseLog | None) -> str:
    """What was assumed of two logs without evidence, and with which option to say otherwise; "" for nothing."""
    doubts = [
        f"{finding.subject} of {log.source}: {finding.value} (--{prefix}{_FLAGS[finding.subject]})"
        for log, prefix in ((capture, ""), (reference, "truth-"))
        if log
        for finding in log.findings
        if finding.assumed and finding.subject in _FLAGS
    ]
    return f" Assumed without evidence: {', '.join(doubts)}." if doubts else ""
