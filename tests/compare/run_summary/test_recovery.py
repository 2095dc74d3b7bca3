"""Recovery measured on errors that are written down here, so that every ratio and time is known beforehand."""

import json
from collections.abc import Callable

import numpy as np
import pytest

from harness.compare.run_summary.recovery import RecoveryCollector, tabulate_recovery
from harness.core.arrays import Floats
from harness.core.estimate import Status
from harness.core.files import to_json_types
from harness.results import Cell

MakeCell = Callable[..., Cell]
END_S = 5.0


@pytest.fixture
def bent(make_cell: MakeCell, truth_qpos: Floats) -> Callable[..., Cell]:
    """A cell of 10 s whose every hinge is off by so many degrees over time, (400,) or one number."""

    def made(kind: str, off_deg: Floats | float, **fields: object) -> Cell:
        judged = make_cell(0.0)
        errors = dict(judged.errors) | {"joint_angle_mean_deg": np.broadcast_to(off_deg, 400).astype(float)}
        scores = type(judged.scores)(judged.scores.metrics, errors, judged.scores.per_joint, judged.scores.scored)
        disturbance = {"kind": kind, "lasts_s": 2.0, "begins_s": END_S - 2.0, "ends_s": END_S}
        return make_cell(
            0.0, **({"scores": scores, "defined_by": {"clip": "walk_01", "disturbance": disturbance}} | fields)
        )

    return made


def course(time_s: Floats, *steps: tuple[float, float]) -> Floats:
    """(400,) a value from each of these moments on."""
    return np.select([time_s >= from_s for from_s, _ in reversed(steps)], [value for _, value in reversed(steps)])


TIME_S = np.arange(400) / 40.0
LAST_BAD_S = END_S - 1.0 / 40.0


def test_the_ratio_is_that_of_the_second_from_one_second_after_the_last_bad_frame(bent: Callable[..., Cell]) -> None:
    cells = [
        bent("none", course(TIME_S, (0.0, 9.0), (LAST_BAD_S + 1.01, 2.0), (LAST_BAD_S + 2.01, 7.0))),
        bent("one_off", course(TIME_S, (0.0, 30.0), (LAST_BAD_S + 1.01, 2.5), (LAST_BAD_S + 2.01, 90.0))),
    ]
    for order in (cells, cells[::-1]):
        recoveries = RecoveryCollector()
        for cell in order:
            recoveries.add(cell)
        (found,) = recoveries.rows()
        assert (found["disturbance"], found["disturbed_deg"], found["undisturbed_deg"]) == ("one_off", 2.5, 2.0)
        assert (found["ratio"], found["status_right"]) == (1.25, 1.0)
        assert found["during"] == pytest.approx(30.0 / 9.0)
        assert found["back_after_s"] == pytest.approx(1.025)


@pytest.mark.parametrize(("back_s", "expected"), [(0.0, 1.0 / 40.0), (0.5, 0.525), (3.0, None)])
def test_how_long_it_took_to_come_back(bent: Callable[..., Cell], back_s: float, expected: float | None) -> None:
    recoveries = RecoveryCollector()
    recoveries.add(bent("none", 2.0))
    recoveries.add(bent("all_lost", course(TIME_S, (0.0, 8.0), (LAST_BAD_S + back_s + 0.01, 2.0))))
    (found,) = recoveries.rows()
    # a mean over 0.25 s of which part is still bad is at most 1.5 times as large with one bad frame of ten at most
    assert found["back_after_s"] == (None if expected is None else pytest.approx(expected, abs=1.0 / 40.0 + 1e-9))
    assert found["ratio"] == pytest.approx(4.0 if back_s == 3.0 else 1.0)


def test_status_is_held_against_what_the_readings_call_for(bent: Callable[..., Cell]) -> None:
    """Nothing reports from 3 to 5 s: LOST is due from 3.5 s on, and demanded from 3.55 s on."""
    valid = np.repeat(((TIME_S < 3.0) | (TIME_S >= 5.0))[:, None], 2, axis=1)
    readings = {"position_valid": valid, "orientation_valid": valid}
    right = np.where(valid[:, 0], Status.SOLVED, np.where(TIME_S - 2.975 > 0.5, Status.LOST, Status.HELD))
    judged = (TIME_S >= 3.0) & (TIME_S <= LAST_BAD_S + 2.0)
    shares = {"right": 1.0, "never lost": 1.0 - 58 / judged.sum(), "boasting": 1.0 - 80 / judged.sum()}
    said = {"right": right, "never lost": np.minimum(right, Status.HELD), "boasting": 0 * right}
    for name, share in shares.items():
        recoveries = RecoveryCollector()
        recoveries.add(bent("none", 2.0))
        recoveries.add(bent("all_lost", 2.0, status=said[name], **readings))
        assert recoveries.rows()[0]["status_right"] == pytest.approx(share, abs=1.1 / judged.sum()), name


def test_only_twins_are_paired(bent: Callable[..., Cell], make_cell: MakeCell) -> None:
    recoveries = RecoveryCollector()
    recoveries.add(make_cell())  # knows no disturbances
    recoveries.add(bent("none", 2.0))
    recoveries.add(bent("one_lost", 3.0, method="mean_pose"))
    elsewhere = {"kind": "one_lost", "lasts_s": 1.0, "begins_s": 3.0, "ends_s": 4.0}
    recoveries.add(bent("one_lost", 3.0, defined_by={"clip": "walk_01", "disturbance": elsewhere}))
    assert recoveries.rows() == []


def test_a_take_that_ends_too_soon_tells_nothing(bent: Callable[..., Cell]) -> None:
    late = {"lasts_s": 2.0, "begins_s": 6.5, "ends_s": 8.5}
    recoveries = RecoveryCollector()
    for kind in ("none", "one_lost"):
        recoveries.add(bent(kind, 2.0, defined_by={"clip": "walk_01", "disturbance": {"kind": kind, **late}}))
    assert [found["evaluated_frames"] for found in recoveries.rows()] == [0]
    (row,) = tabulate_recovery(json.loads(json.dumps(to_json_types(recoveries.rows()))))
    assert (row["clips"], row["after"]) == (0, {"one_lost": None})


def test_the_table_pools_clips_and_shows_the_worst(bent: Callable[..., Cell]) -> None:
    recoveries = RecoveryCollector()
    for clip, plain_deg, other_deg in (("a", 2.0, 2.0), ("b", 1.0, 2.5)):
        for kind, off_deg in (("none", plain_deg), ("all_turned", other_deg)):
            disturbance = {"kind": kind, "lasts_s": 2.0, "begins_s": 3.0, "ends_s": 5.0}
            recoveries.add(bent(kind, off_deg, clip=clip, defined_by={"clip": clip, "disturbance": disturbance}))
    rows = json.loads(json.dumps(to_json_types(recoveries.rows())))
    (row,) = tabulate_recovery(rows)
    assert (row["method"], row["clips"], row["undisturbed_deg"]) == ("ik", 2, 1.5)
    assert row["after"] == {"all_turned": {"ratio": 1.5, "during": 1.75, "worst": 2.5, "back_after_s": None}}
