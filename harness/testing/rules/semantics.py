"""Rules about the meaning of estimates: status, recovery after disturbances, independence of position and heading."""

import math

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.estimate import HINGE_COUNT, LOST_AFTER_S, Origin, Status, session_lag
from harness.core.split import EXAMPLES, NONE, UNKNOWN, declared_training_data, training_note
from harness.errors import BadInput
from harness.reconstruct.solver import OLDEST_S, Loss, Residuals
from harness.results import MAX_FALLBACK_SHARE
from harness.score import WARM_UP_S, wrap_difference
from harness.testing.contract_case import (
    DISTURBANCES,
    FRAMES,
    RATE_HZ,
    ContractCase,
    Frames,
    RuleViolation,
    disturb_frames,
    stack_qpos,
    transform_motion,
)
from harness.testing.frames import drop_stations, exact_frames

MAX_RECOVERED_RATIO = 1.5
"""An error has recovered when it is at most this many times that of an undisturbed session, plus `_TOLERANCE_MM`."""
_TOLERANCE_MM = 5.0
_POSTURE_TOLERANCE_DEG = 0.5
"""Largest mean difference of two postures that should be equal: solvers stop early, and sums are rounded [deg]."""


def reports_tracking_loss(case: ContractCase) -> str:
    """The status is SOLVED with at least half of the stations, else HELD, and LOST after more than 0.5 s.

    A method may count a silent station as known for `OLDEST_S`, because it predicts it (`solver.reading_prediction`).
    """
    count = len(case.calibration.stations)
    for silent in (range(1), range(count // 2), range(count // 2 + 1), range(count)):
        unsolved = range(10, 40) if 2 * len(silent) > count else range(0)
        frames = [drop_stations(f, silent) if 10 <= i < 40 else f for i, f in enumerate(case.frames)]
        status = [estimate.status for estimate in case.run(frames)]
        when = f"while {len(silent)} of {count} stations reported nothing"
        for i in unsolved:
            duration_s = frames[i].received_s - frames[unsolved.start - 1].received_s
            if status[i] not in (possible := _statuses_after(duration_s)):
                raise RuleViolation(
                    f"the status was {status[i].name} {when}, for {duration_s:.2f} s; it must be "
                    + " or ".join(one.name for one in possible)
                )
        wrong = next((i for i in range(40) if i not in unsolved and status[i] is not Status.SOLVED), None)
        if wrong is not None:
            when = when if wrong >= 10 else "while all stations reported"
            raise RuleViolation(f"the status in frame {wrong} was {status[wrong].name} {when}; it must be SOLVED")
        if status[-1] is not Status.SOLVED:
            raise RuleViolation(
                f"the status was {status[-1].name} half a second after every station reported again; it must be SOLVED"
            )
    return "the status was HELD, LOST after 0.5 s, then SOLVED again"


def _statuses_after(silent_s: float) -> list[Status]:
    """What the status may be while most stations have been silent for so long [s]."""
    least_s = {Status.SOLVED: 0.0, Status.HELD: 0.0, Status.LOST: LOST_AFTER_S}
    most_s = {Status.SOLVED: OLDEST_S, Status.HELD: OLDEST_S + LOST_AFTER_S, Status.LOST: math.inf}
    return [one for one in least_s if least_s[one] - 1e-9 <= silent_s <= most_s[one] + 1e-9]


def answers_by_its_model(case: ContractCase) -> str:
    """After 1 s, at most 5 % of the frames in which every station reports are answered by a fallback."""
    origins = [estimate.origin for estimate in case.run(case.long_frames)][round(WARM_UP_S * RATE_HZ) :]
    share = float(np.mean([origin is not Origin.MODEL for origin in origins]))
    text = f"{share:.0%} of {len(origins)} undisturbed frames were not answered by the model"
    if share > MAX_FALLBACK_SHARE:
        raise RuleViolation(f"{text}, at most {MAX_FALLBACK_SHARE:.0%} may be")
    return text


def recovers_from_disturbances(case: ContractCase) -> str:
    """1 s after a disturbance of 1 s, the error at the stations is at most 1.5 times that of an undisturbed session.

    Hinges that no station observes are not checked here, since that takes real motion: see `harness run recovery`.
    """
    undisturbed_mm = _station_error_mm(case, case.long_frames)
    worst, detail = 0.0, ""
    for name in DISTURBANCES:
        frames, window = disturb_frames(case.long_frames, name)
        expected, after = (float(x[window].mean()) for x in (undisturbed_mm, _station_error_mm(case, frames)))
        text = f"{after:.2f} mm after '{name}', {expected:.2f} mm undisturbed"
        if not after <= MAX_RECOVERED_RATIO * expected + _TOLERANCE_MM:
            raise RuleViolation(text)
        if (ratio := after / max(expected, _TOLERANCE_MM)) > worst:
            worst, detail = ratio, text
    return detail


def is_invariant_to_placement(case: ContractCase) -> str:
    """Hinges, tilt and height are the same when the motion is turned and shifted in the room."""
    transformed = transform_motion(case.truth, 2.0, np.array([5.0, -3.0, 0.0]))
    frames = exact_frames(case.body, case.calibration, transformed[:FRAMES], RATE_HZ)
    original, moved = (stack_qpos(case.run(f)) for f in (case.frames, frames))
    hinges_rad = np.abs(wrap_difference(moved[:, 7:] - original[:, 7:])).mean(axis=1)
    tilt_rad = rotations.angle_between_rad(*(_remove_heading(qpos) for qpos in (original, moved)))
    angle_deg = np.rad2deg(np.maximum(hinges_rad, tilt_rad)).mean()
    height_mm = 1e3 * float(np.abs(moved[:, 2] - original[:, 2]).mean())
    text = f"the postures differ by {angle_deg:.2g} deg and {height_mm:.2g} mm on average"
    if not (angle_deg <= _POSTURE_TOLERANCE_DEG and height_mm <= _TOLERANCE_MM):
        raise RuleViolation(text)
    return text


def keeps_lag_and_uncertainty(case: ContractCase) -> str:
    """Estimates answer the frame a fixed number of steps before; standard deviations are in all of them, or in none.

    Standard deviations are finite and above 0. Both hold while stations are lost, too.
    """
    count, text = len(case.calibration.stations), ""
    for silent in (range(0), range(1), range(count)):
        frames = [drop_stations(f, silent) if 10 <= i < 40 else f for i, f in enumerate(case.frames)]
        estimates = case.steps(frames)
        when = f"with {len(silent)} of {count} stations lost"
        try:
            lag = session_lag([getattr(estimate, "lag", 0) for estimate in estimates])
        except ValueError as error:
            raise RuleViolation(f"{error} ({when})") from error
        sigmas = [getattr(estimate, "angle_sigma_rad", None) for estimate in estimates]
        given = [np.asarray(sigma, dtype=float) for sigma in sigmas if sigma is not None]
        if len(given) not in (0, len(estimates)):
            raise RuleViolation(f"{len(given)} of {len(estimates)} estimates have standard deviations {when}")
        for sigma in given:
            if sigma.shape != (HINGE_COUNT,) or not np.all(np.isfinite(sigma) & (sigma > 0.0)):
                raise RuleViolation(f"standard deviations of shape {sigma.shape} are not all above 0 rad {when}")
        found = f"a lag of {lag} frames, {'standard deviations' if given else 'no standard deviations'}"
        if text and found != text:
            raise RuleViolation(f"{found} {when}; {text} without losses")
        text = found
    return text


def declares_training_data(case: ContractCase) -> str:
    """The declared training data is a text that agrees with `needs_examples`; a method without one passes."""
    try:
        declared = declared_training_data(case.method)
    except BadInput as error:
        raise RuleViolation(str(error)) from error
    if declared == (NONE if case.method.needs_examples else EXAMPLES):
        raise RuleViolation(f"training_data is {declared!r}, but needs_examples is {case.method.needs_examples}")
    missing = ", as its rank will say; declare it by the attribute training_data" if declared == UNKNOWN else ""
    return training_note(declared) + missing or f"training data: {declared}"


def _station_error_mm(case: ContractCase, frames: Frames) -> Floats:
    """(T,) mean distance between the stations of the estimates and those of undisturbed readings [mm]."""
    residuals, error_m = Residuals(case.body, case.calibration, Loss()), []
    for frame, qpos in zip(case.long_frames, stack_qpos(case.run(frames)), strict=False):
        residuals.read(frame)
        residuals.evaluate(qpos)
        error_m.append(residuals.distance[: len(residuals.bones)].mean())
    return 1e3 * np.array(error_m)


def _remove_heading(qpos: Floats) -> Floats:
    """(T, 4) root orientations without their heading."""
    return rotations.multiply(rotations.about_z(-rotations.yaw_rad(qpos[:, 3:7])), qpos[:, 3:7])
