"""Rules about degraded input: every estimate must be a valid pose, however poor the readings are."""

from dataclasses import replace

from harness.core.estimate import Status
from harness.core.seeds import generator
from harness.testing.contract_case import (
    FRAMES,
    RATE_HZ,
    ContractCase,
    RuleViolation,
    keep_orientations,
    keep_positions,
    require_pose,
    require_poses,
    run_session,
)
from harness.testing.frames import drop_stations, exact_calibration, exact_frames


def gives_valid_poses(case: ContractCase) -> str:
    """Good frames give finite poses with a unit quaternion near the stations, and a status."""
    return require_poses(case, case.frames)


def tolerates_partial_readings(case: ContractCase) -> str:
    """Positions only, orientations only, one station only: each for a whole session, then one after another."""
    third, last = FRAMES // 3, range(1, len(case.calibration.stations))
    for degrade in (keep_positions, keep_orientations, lambda frame: drop_stations(frame, last)):
        require_poses(case, [degrade(frame) for frame in case.frames])
    turns = [keep_positions] * third + [keep_orientations] * third + [lambda frame: drop_stations(frame, last)] * third
    return require_poses(case, [degrade(frame) for degrade, frame in zip(turns, case.frames, strict=True)])


def tolerates_dropouts(case: ContractCase) -> str:
    """Each station alone, then all of them, report nothing for 0.75 s; in a last session all do so at the start."""
    stations = range(len(case.calibration.stations))
    for silent in (*([s] for s in stations), [*stations]):
        require_poses(case, [drop_stations(f, silent) if 20 <= i < 50 else f for i, f in enumerate(case.frames)])
    require_poses(case, [drop_stations(f, stations) if i < 10 else f for i, f in enumerate(case.frames)])
    return f"{len(stations) + 2} patterns of lost stations"


def tolerates_irregular_timing(case: ContractCase) -> str:
    """Frames arrive up to 20 ms late, and 3 in 10 are missing."""
    rng = generator(1, "irregular time")
    received = [f for f in case.frames if rng.random() < 0.7]
    shifts = rng.uniform(0.0, 0.02, len(received))
    return require_poses(
        case,
        [
            replace(f, received_s=f.received_s + s, measured_s=f.measured_s + s)
            for f, s in zip(received, shifts, strict=True)
        ],
    )


def tolerates_any_quality(case: ContractCase) -> str:
    """Readings have any quality above 0, and one in five is suspect."""
    rng, count = generator(1, "quality"), len(case.calibration.stations)
    return require_poses(
        case,
        [
            replace(f, quality=rng.uniform(1.0 / 255.0, 1.0, count) ** 2, suspect=rng.random(count) < 0.2)
            for f in case.frames
        ],
    )


def supports_other_stations(case: ContractCase) -> str:
    """Calibrations with one, three and seven stations."""
    station_sets = (
        ("right_wrist",),
        ("left_hand", "right_hand", "torso"),
        ("pelvis", "left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head"),
    )
    for stations in station_sets:
        calibration = exact_calibration(case.body, stations)
        frames = exact_frames(case.body, calibration, case.truth[:20], RATE_HZ)
        estimates = run_session(case.reconstructor.begin(calibration), frames)
        for index, estimate in enumerate(estimates):
            require_pose(case, index, estimate)
        if estimates[-1].status is not Status.SOLVED:
            raise RuleViolation(
                f"the status was {estimates[-1].status.name} while all {len(stations)} stations reported"
            )
    return "sets of " + ", ".join(str(len(stations)) for stations in station_sets)
