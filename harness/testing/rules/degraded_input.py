"""Rules about what comes in: every answer is a pose, however poor the frames are."""

from dataclasses import replace

from harness.core.estimate import Status
from harness.core.seeds import generator
from harness.testing.contract_case import FRAMES, RATE_HZ, ContractCase, keep_orientations, keep_positions, run_session
from harness.testing.frames import drop_stations, exact_calibration, exact_frames
from harness.testing.rules.assertions import RuleViolation, require_pose, require_poses


def gives_valid_poses(trial: ContractCase) -> str:
    """Finite numbers, a unit quaternion, a place in the room, a status."""
    return require_poses(trial, trial.frames)


def tolerates_partial_readings(trial: ContractCase) -> str:
    """Positions only, orientations only, one station only, each from the first frame on; and all of it in turn."""
    third, last = FRAMES // 3, range(1, len(trial.calibration.stations))
    for poor in (keep_positions, keep_orientations, lambda frame: drop_stations(frame, last)):
        require_poses(trial, [poor(frame) for frame in trial.frames])
    turns = [keep_positions] * third + [keep_orientations] * third + [lambda frame: drop_stations(frame, last)] * third
    return require_poses(trial, [poor(frame) for poor, frame in zip(turns, trial.frames, strict=True)])


def tolerates_dropouts(trial: ContractCase) -> str:
    """Single stations, then all of them, fall silent for 0.75 s and come back; and all at the start."""
    everyone = range(len(trial.calibration.stations))
    for silent in (*([s] for s in everyone), [*everyone]):
        require_poses(trial, [drop_stations(f, silent) if 20 <= i < 50 else f for i, f in enumerate(trial.frames)])
    require_poses(trial, [drop_stations(f, everyone) if i < 10 else f for i, f in enumerate(trial.frames)])
    return f"{len(everyone) + 2} losses"


def tolerates_irregular_timing(trial: ContractCase) -> str:
    """Frames come early, late, or not at all."""
    rng = generator(1, "irregular time")
    kept = [f for f in trial.frames if rng.random() < 0.7]
    shifts = rng.uniform(0.0, 0.02, len(kept))
    return require_poses(
        trial,
        [
            replace(f, received_s=f.received_s + s, measured_s=f.measured_s + s)
            for f, s in zip(kept, shifts, strict=True)
        ],
    )


def tolerates_any_quality(trial: ContractCase) -> str:
    """Quality anywhere above 0, and suspect readings."""
    rng, count = generator(1, "quality"), len(trial.calibration.stations)
    return require_poses(
        trial,
        [
            replace(f, quality=rng.uniform(1.0 / 255.0, 1.0, count) ** 2, suspect=rng.random(count) < 0.2)
            for f in trial.frames
        ],
    )


def supports_other_stations(trial: ContractCase) -> str:
    """One station, three, and seven: a calibration may name any."""
    worn_sets = (
        ("right_wrist",),
        ("left_hand", "right_hand", "torso"),
        ("pelvis", "left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head"),
    )
    for stations in worn_sets:
        calibration = exact_calibration(trial.body, stations)
        frames = exact_frames(trial.body, calibration, trial.truth[:20], RATE_HZ)
        estimates = run_session(trial.reconstructor.begin(calibration), frames)
        for index, estimate in enumerate(estimates):
            require_pose(trial, index, estimate)
        if estimates[-1].status is not Status.SOLVED:
            raise RuleViolation(f"{estimates[-1].status.name} although all {len(stations)} stations reported")
    return "sets of " + ", ".join(str(len(stations)) for stations in worn_sets)
