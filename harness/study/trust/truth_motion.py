"""Reference motion of a capture: poses of the bodies that carry the stations, from one of five sources."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.body import bone_poses, retarget_to_own_body
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.humanoid24 import BONES
from harness.core.motion import BodyMotion, Clip, count_steps
from harness.core.skeleton import Skeleton
from harness.errors import BadInput
from harness.experiment import Playback
from harness.experiment.scenarios import Scenario
from harness.measure import TruthPoses
from harness.simulate import exact_calibration, loop_motion
from harness.stream import PoseLog
from harness.study.trust.capture_readings import CaptureReadings, measured_poses

_MARGIN_S = 0.5
"""Time for which the loops of an emulator reach beyond a capture [s]."""


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
    is_tracker: bool = False
    """Whether the reference is a tracker too, with errors of its own that a comparison with a preset would name."""
    log: PoseLog | None = None
    """The pose log that the reference is, whose conventions nobody states; None for another reference."""
    noise: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Body -> standard deviations of its positions [m] and rotations [rad] on each axis, where they are known."""
    loop_s: float = math.inf
    """Time after which the reference repeats [s]."""
    playback: Playback | None = None
    """The motion of a scenario's performer, on which methods can be scored."""
    notes: tuple[str, ...] = ()
    """What to know about the reference, a sentence each."""


def truth_of_playback(
    playback: Playback, stations: Sequence[str] = (), *, host_clock: bool, device_s: tuple[float, float] | None = None
) -> TruthMotion:
    """The bones of a performer whose motion a simulator or an emulator played.

    `stations` are the capture's names of the playback's stations, by default the same names. With the first and last
    `device_s` of the capture [s], the motion is that of an emulator's loops, which the device's clock counts from zero.
    """
    calibration = exact_calibration(playback.body, playback.mounts, playback.tracker)
    motion, times_s, loop_s = playback.take, np.zeros(1), math.inf
    if device_s is not None:
        motion = loop_motion(playback.body, playback.take, playback.mounts, playback.tracker)
        loop_s = playback.samples.loop_s
        count_steps(device_s[1] - min(device_s[0], 0.0), 1.0 / playback.take.rate_hz, "Stamps of the capture")
        first, last = (math.floor(max(at_s, 0.0) / loop_s) for at_s in device_s)
        times_s = loop_s * np.arange(first, last + 1, dtype=np.float64)
    bodies = _bone_truths(playback.body.skeleton, motion, calibration.bones, times_s)
    if device_s is not None:  # as long as the capture, so that other loops overlap it less
        bodies = {bone: _cut(truth, *device_s) for bone, truth in bodies.items()}
    clip, duration_s = playback.clip_evaluation.part, playback.take.duration_s
    names = tuple(stations) or calibration.stations
    return TruthMotion(
        f"clip {clip} of the scenario {playback.scenario.name}, {duration_s:.1f} s",
        bodies,
        dict(zip(names, calibration.bones, strict=True)),
        nominal_mounts(calibration, names),
        host_clock,
        loop_s=loop_s,
        playback=playback,
    )


def truth_of_clip(clip: Clip, scenario: Scenario, stations: Sequence[str]) -> TruthMotion:
    """The bones of a clip on the performer's own body, with the stations of a scenario; BadInput for others."""
    body, take = retarget_to_own_body(clip)
    mounts = {mount.station: mount for mount in scenario.nominal_mounts}
    missing = [name for name in stations if name not in mounts]
    if missing:
        raise BadInput(
            f"{scenario.name} has no station {missing[0]!r}.", f"Name a scenario with it; it has {', '.join(mounts)}."
        )
    calibration = exact_calibration(body, [mounts[name] for name in stations], scenario.device)
    return TruthMotion(
        f"the clip {clip.name}, {clip.duration_s:.1f} s",
        _bone_truths(body.skeleton, take, calibration.bones, np.zeros(1)),
        dict(zip(calibration.stations, calibration.bones, strict=True)),
        nominal_mounts(calibration, calibration.stations),
    )


def _bone_truths(
    skeleton: Skeleton, motion: BodyMotion, bones: Sequence[str], begins_s: Floats
) -> dict[str, TruthPoses]:
    """Poses of bones during a motion that begins at each of these times (L,) [s]."""
    position_m, world_from_bone = bone_poses(skeleton, motion.qpos)
    time_s = (begins_s[:, None] + np.arange(len(motion)) / motion.rate_hz).ravel()
    truths = {}
    for bone in dict.fromkeys(bones):
        row = BONES.index(bone)
        place, turn = (np.tile(values[:, row], (len(begins_s), 1)) for values in (position_m, world_from_bone))
        truths[bone] = TruthPoses(time_s, place, turn)
    return truths


def _cut(truth: TruthPoses, begin_s: float, end_s: float) -> TruthPoses:
    kept = (truth.time_s >= begin_s - _MARGIN_S) & (truth.time_s <= end_s + _MARGIN_S)
    return TruthPoses(truth.time_s[kept], truth.position_m[kept], truth.world_from_body[kept])


def nominal_mounts(calibration: Calibration, stations: Sequence[str]) -> dict[str, NominalMount]:
    """The mounts of a calibration by these names of its stations."""
    mounts = zip(stations, calibration.mount_m, calibration.bone_from_station, strict=True)
    return {station: NominalMount(mount_m, turn) for station, mount_m, turn in mounts}


def truth_of_capture(other: CaptureReadings, stations: Sequence[str]) -> TruthMotion:
    """Another capture as the reference: its stations are the bodies.

    Times are those of its device's clock. BadInput as `pair_names`.
    """
    bodies = {}
    for name, readings in other.readings.items():
        poses = measured_poses(readings)
        rows = poses.rising_rows()
        bodies[name] = TruthPoses(poses.measured_s[rows], poses.position_m[rows], poses.tracker_from_station[rows])
    lost = (f"{other.path.name}: {text}" for text in (*other.left_out, *other.damage))
    note = "Scale, heading and clocks are those relative to the other tracker, and are not compared with a preset."
    return TruthMotion(
        f"the capture {other.path.name}", bodies, pair_names(stations, bodies), is_tracker=True, notes=(note, *lost)
    )


def pair_names(stations: Sequence[str], bodies: Mapping[str, TruthPoses]) -> dict[str, str]:
    """Each station with the body of its name, in capital or small letters, or the only one with the only body.

    Stations without a body are left out. BadInput where none has one.
    """
    if len(stations) == len(bodies) == 1:
        return dict(zip(stations, bodies, strict=True))
    named = {body.lower(): body for body in bodies}
    pairs = {station: named[station.lower()] for station in stations if station.lower() in named}
    if not pairs:
        raise BadInput(
            f"The reference has no body {', '.join(stations)}; it has {', '.join(bodies) or 'none'}.",
            "Name its bodies as the stations of the capture.",
        )
    return pairs
