"""Rules about what comes in: every answer is a pose, however poor the frames are."""

from dataclasses import replace

from harness.core.estimate import Status
from harness.core.seeds import generator
from harness.testing.contract_case import FRAMES, RATE_HZ, Trial, only_orientations, only_positions, told
from harness.testing.frames import exact_frames, without, worn
from harness.testing.rules.assertions import Broken, poses, require_pose


def answers_are_poses(trial: Trial) -> str:
    """Finite numbers, a unit quaternion, a place in the room, a status."""
    return poses(trial, trial.frames)


def bears_poor_input(trial: Trial) -> str:
    """Positions only, orientations only, one station only, each from the first frame on; and all of it in turn."""
    third, last = FRAMES // 3, range(1, len(trial.calibration.stations))
    for poor in (only_positions, only_orientations, lambda frame: without(frame, last)):
        poses(trial, [poor(frame) for frame in trial.frames])
    turns = [only_positions] * third + [only_orientations] * third + [lambda frame: without(frame, last)] * third
    return poses(trial, [poor(frame) for poor, frame in zip(turns, trial.frames, strict=True)])


def bears_losses(trial: Trial) -> str:
    """Single stations, then all of them, fall silent for 0.75 s and come back; and all at the start."""
    everyone = range(len(trial.calibration.stations))
    for silent in (*([s] for s in everyone), [*everyone]):
        poses(trial, [without(f, silent) if 20 <= i < 50 else f for i, f in enumerate(trial.frames)])
    poses(trial, [without(f, everyone) if i < 10 else f for i, f in enumerate(trial.frames)])
    return f"{len(everyone) + 2} losses"


def bears_irregular_time(trial: Trial) -> str:
    """Frames come early, late, or not at all."""
    rng = generator(1, "irregular time")
    kept = [f for f in trial.frames if rng.random() < 0.7]
    shifts = rng.uniform(0.0, 0.02, len(kept))
    return poses(
        trial,
        [
            replace(f, received_s=f.received_s + s, measured_s=f.measured_s + s)
            for f, s in zip(kept, shifts, strict=True)
        ],
    )


def bears_any_quality(trial: Trial) -> str:
    """Quality anywhere above 0, and suspect readings."""
    rng, count = generator(1, "quality"), len(trial.calibration.stations)
    return poses(
        trial,
        [
            replace(f, quality=rng.uniform(1.0 / 255.0, 1.0, count) ** 2, suspect=rng.random(count) < 0.2)
            for f in trial.frames
        ],
    )


def wears_other_stations(trial: Trial) -> str:
    """One station, three, and seven: a calibration may name any."""
    worn_sets = (
        ("right_wrist",),
        ("left_hand", "right_hand", "torso"),
        ("pelvis", "left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head"),
    )
    for stations in worn_sets:
        calibration = worn(trial.body, stations)
        frames = exact_frames(trial.body, calibration, trial.truth[:20], RATE_HZ)
        estimates = told(trial.reconstructor.begin(calibration), frames)
        for index, estimate in enumerate(estimates):
            require_pose(trial, index, estimate)
        if estimates[-1].status is not Status.SOLVED:
            raise Broken(f"{estimates[-1].status.name} although all {len(stations)} stations reported")
    return "sets of " + ", ".join(str(len(stations)) for stations in worn_sets)
