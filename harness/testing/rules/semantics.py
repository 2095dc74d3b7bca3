"""Rules about what answers mean: what the status says, how soon an error passes, and that places do not count."""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.estimate import Status
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.status_monitor import LOST_AFTER_S
from harness.score.angles import wrap_angle
from harness.testing.contract_case import (
    DISTURBANCES,
    FRAMES,
    RATE_HZ,
    ContractCase,
    Frames,
    disturb_frames,
    stack_qpos,
    transform_motion,
)
from harness.testing.frames import drop_stations, exact_frames
from harness.testing.rules.assertions import RuleViolation

MAX_RECOVERED_RATIO = 1.5
"""An error is that of an undisturbed session again when it is at most so many times as large (issue of the papers'
reconstructors), or larger by no more than `_SLACK`."""
_TOLERANCE_MM = 5.0
_POSTURE_TOLERANCE_DEG = 0.5
"""Mean difference of two answers that should be alike: solvers stop early, and sums are rounded."""


def reports_tracking_loss(trial: ContractCase) -> str:
    """SOLVED with at least half of the stations; else HELD, LOST once that lasts more than 0.5 s; and back."""
    count = len(trial.calibration.stations)
    for silent in (range(1), range(count // 2), range(count // 2 + 1), range(count)):
        gone = range(10, 40) if 2 * len(silent) > count else range(0)
        frames = [drop_stations(f, silent) if 10 <= i < 40 else f for i, f in enumerate(trial.frames)]
        status = [estimate.status for estimate in trial.run(frames)]
        who = f"while {len(silent)} of {count} stations were silent"
        for i in gone:
            for_s = frames[i].received_s - frames[gone.start - 1].received_s
            expected = Status.LOST if for_s > LOST_AFTER_S + 1e-9 else Status.HELD
            if status[i] is not expected and abs(for_s - LOST_AFTER_S) > 1e-9:
                raise RuleViolation(f"{status[i].name} {who}, for {for_s:.2f} s: {expected.name} is right")
        bad = [i for i in range(40) if i not in gone and status[i] is not Status.SOLVED]
        if bad:
            raise RuleViolation(
                f"{status[bad[0]].name} in frame {bad[0]} {who if bad[0] >= 10 else 'while all reported'}"
            )
        if status[-1] is not Status.SOLVED:
            raise RuleViolation(f"{status[-1].name} half a second after every station reported again")
    return "HELD, LOST after 0.5 s, SOLVED again"


def recovers_from_disturbances(trial: ContractCase) -> str:
    """1 s after what lasted 1 s the stations' error is at most 1.5 times that of a session which nothing befell.

    Hinges that no station shows are not judged here, for that takes real motion: `harness run recovery` does.
    """
    plain_mm = _station_error_mm(trial, trial.long_frames)
    worst, which = 0.0, ""
    for what in DISTURBANCES:
        frames, judged = disturb_frames(trial.long_frames, what)
        before, after = (float(x[judged].mean()) for x in (plain_mm, _station_error_mm(trial, frames)))
        seen = f"{after:.2f} mm after {what}, {before:.2f} without"
        if not after <= MAX_RECOVERED_RATIO * before + _TOLERANCE_MM:
            raise RuleViolation(seen)
        if (ratio := after / max(before, _TOLERANCE_MM)) > worst:
            worst, which = ratio, seen
    return which


def is_invariant_to_placement(trial: ContractCase) -> str:
    """The posture is the same in a room that is turned and shifted: hinges, tilt and height."""
    other = transform_motion(trial.truth, 2.0, np.array([5.0, -3.0, 0.0]))
    frames = exact_frames(trial.body, trial.calibration, other[:FRAMES], RATE_HZ)
    here, there = (stack_qpos(trial.run(f)) for f in (trial.frames, frames))
    apart_rad = np.abs(wrap_angle(there[:, 7:] - here[:, 7:])).mean(axis=1)
    tilt_rad = rotations.angle_between_rad(*(_remove_heading(qpos) for qpos in (here, there)))
    apart_deg = np.rad2deg(np.maximum(apart_rad, tilt_rad)).mean()
    higher_m = float(np.abs(there[:, 2] - here[:, 2]).mean())
    seen = f"{apart_deg:.2g} deg and {1e3 * higher_m:.2g} mm apart on average"
    if not (apart_deg <= _POSTURE_TOLERANCE_DEG and 1e3 * higher_m <= _TOLERANCE_MM):
        raise RuleViolation(seen)
    return seen


def _station_error_mm(trial: ContractCase, frames: Frames) -> Floats:
    """(T,) of a new session: mean distance of the stations from where undisturbed readings have them [mm]."""
    judge, off_m = Residuals(trial.body, trial.calibration, Loss()), []
    for frame, qpos in zip(trial.long_frames, stack_qpos(trial.run(frames)), strict=False):
        judge.read(frame)
        judge.evaluate(qpos)
        off_m.append(judge.distance[: len(judge.bones)].mean())
    return 1e3 * np.array(off_m)


def _remove_heading(qpos: Floats) -> Floats:
    """(T, 4) root orientations without their heading."""
    return rotations.multiply(rotations.about_z(-rotations.yaw_rad(qpos[:, 3:7])), qpos[:, 3:7])
