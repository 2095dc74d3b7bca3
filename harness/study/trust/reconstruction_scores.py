"""Reconstruction from a registered capture: methods run on its frames and are scored against the reference."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness.calibrate.calibration_file import CalibrationFile
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.progress import ProgressCallback
from harness.errors import BadInput, RenamedKey, UnknownName
from harness.experiment.isolation import DEFAULT_ISOLATION
from harness.experiment.method_run import describe_failure
from harness.experiment.remote_method import resolve_method, run_over_frames
from harness.measure.registration import Registration
from harness.results.reconstruction_score import ReconstructionScore
from harness.score.score import WARM_UP_S, score_estimate
from harness.simulate.trajectory import Trajectory
from harness.stream.frame import TrackerFrame
from harness.stream.recording.replay import RecordingStream
from harness.study.trust.validation import Validation

SCORED_METRICS = ("joint_angle_mean_deg", "mpjpe_mm", "root_position_mm", "jitter_m_s3")


def measured_calibration(registration: Registration, names: Sequence[str] = ()) -> Calibration:
    """Mounts and room as the registration found them, for methods; `names` of the stations replace the capture's."""
    mounts = registration.mounts.values()
    return Calibration(
        kind="registered",
        stations=tuple(names) or tuple(mount.station for mount in mounts),
        bones=tuple(mount.body for mount in mounts),
        mount_m=np.array([mount.position_m for mount in mounts]),
        bone_from_station=np.array([mount.body_from_station for mount in mounts]),
        world_from_tracker=registration.world_from_tracker,
        tracker_origin_m=registration.tracker_origin_m,
    )


def score_registered(
    path: Path,
    found: Validation,
    methods: Sequence[str],
    progress: ProgressCallback = lambda step, done, planned: None,
) -> list[ReconstructionScore]:
    """Run methods on the frames of a capture with the registered calibration, and score them on the performer's body.

    A frame's true pose is that of the reference at the frame's mean time. Frames outside the reference, and those of
    the first second, are not scored; of several loops the one with the most frames is. A method that fails has no
    values, and stops no other. BadInput where the reference has no performer or no frame is inside it.
    """
    playback = found.truth.playback
    if playback is None:
        raise BadInput(f"{found.truth.title} has no performer.", "Methods are scored on a clip.")
    missing = [name for name in found.reader.wire.stations if name not in found.registration.mounts]
    if missing:
        raise BadInput(f"{missing[0]} has no mount.", "Methods need the mount of every station of the capture.")
    frames = list(RecordingStream(path))
    time_s = truth_times_s(frames, found.registration)
    trajectory = Trajectory(playback.body, playback.take)
    loop, time_s = np.divmod(time_s, found.truth.loop_s)
    inside = (time_s >= 0.0) & (time_s <= trajectory.duration_s)
    most = max(np.unique(loop[inside]), key=lambda number: int(np.sum(loop[inside] == number)), default=0.0)
    rows = np.flatnonzero(inside & (loop == most))
    if len(rows) < 2.0 * WARM_UP_S * found.reader.wire.rate_hz:
        raise BadInput(f"{len(rows)} frames lie inside the reference.", "Record the motion of the reference.")
    truth_qpos = trajectory.qpos(time_s[rows])
    estimated = CalibrationFile(measured_calibration(found.registration, tuple(playback.scenario.stations)), None)
    calibrated = playback.with_calibration(estimated)
    out = []
    for done, name in enumerate(methods):
        progress(f"reconstructing with {name}", done, len(methods))
        values, failure = dict[str, float | None](), ""
        try:
            fitted = playback.clip_evaluation.fit_method(resolve_method(name, DEFAULT_ISOLATION), name)
            seen = [frames[row] for row in rows.tolist()]
            answers, lag = run_over_frames(fitted, calibrated.calibration, seen).by_frame()
            kept = np.arange(len(rows) - lag)
            values = dict(
                score_estimate(
                    playback.body.skeleton,
                    found.reader.wire.rate_hz,
                    truth_qpos,
                    answers.qpos,
                    kept,
                    answers.status,
                    np.full(len(kept), np.nan),
                ).metrics
            )
        except (UnknownName, RenamedKey, BadInput):
            raise
        except (Exception, SystemExit) as error:  # a method may raise anything: it fails alone
            failure = describe_failure(error)
        out += [ReconstructionScore(name, metric, values.get(metric), failure) for metric in SCORED_METRICS]
    return out


def truth_times_s(frames: Sequence[TrackerFrame], registration: Registration) -> Floats:
    """(F,) mean time of each frame by the reference's clock [s]; NaN without stamps."""
    stamps_s = np.array([frame.measured_s for frame in frames])
    counted = np.isfinite(stamps_s)
    mean_s = np.where(counted, stamps_s, 0.0).sum(axis=1) / np.maximum(counted.sum(axis=1), 1)
    out = registration.state.truth_time_s(mean_s)
    return np.where(counted.any(axis=1), out, np.nan)
