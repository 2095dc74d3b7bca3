"""Sources of poses at uneven times: even series, noise at rest and in motion, repeats, and surveyed points."""

import math
from dataclasses import replace

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.number_format import Interval
from harness.errors import BadInput
from harness.measure.log_profile import measure_log_profile
from harness.measure.log_series import even_series, neighbour_noise
from harness.measure.profile import Bar
from harness.measure.sampling import describe_sampling
from harness.measure.surveyed_points import RestPlace, compare_with_survey
from harness.measure.uncertainty import BudgetComponent, UncertaintyBudget
from harness.stream import BodyPoses, PoseLog
from tests.measure.foreign_streams import resting_times

WHITE_M, DRIFT_M, CORRELATION_S = 0.0004, 0.0011, 1.5


def resting(rng: np.random.Generator, seconds: float, name: str = "tracker") -> BodyPoses:
    """A body at rest with white noise and drift, at steps of 10 to 23 ms, without every fiftieth pose, with a pause."""
    time_s = resting_times(rng, seconds)
    wander = rng.normal(size=(len(time_s), 3))
    for row, step_s in enumerate(np.diff(time_s), 1):
        kept = math.exp(-step_s / CORRELATION_S)
        wander[row] = kept * wander[row - 1] + math.sqrt(1.0 - kept**2) * wander[row]
    place = DRIFT_M * wander + WHITE_M * rng.normal(size=wander.shape) + np.array([1.0, 0.2, 1.4])
    turn = rotations.exp(0.0006 * rng.normal(size=wander.shape)) * rng.choice([-1.0, 1.0], len(time_s))[:, None]
    time_s = time_s + 25.0 * (time_s > 0.5 * seconds)
    rows = np.arange(len(time_s)) % 50 != 7
    return BodyPoses(name, time_s[rows], place[rows], turn[rows])


def moving(rng: np.random.Generator, noise_m: float, seconds: float = 60.0) -> tuple[Floats, Floats, Floats]:
    time_s = resting_times(rng, seconds, 0.012, 0.03)
    phase = np.array([0.0, 1.0, 2.0])
    place = 0.8 * np.sin(np.array([0.5, 0.7, 0.4]) * time_s[:, None] + phase) + np.array([1.0, 0.0, 1.0])
    turn = rotations.exp(0.8 * np.sin(np.array([0.9, 0.6, 1.2]) * time_s[:, None] + phase))
    return time_s, place + noise_m * rng.normal(size=place.shape), turn


def log_of(*bodies: BodyPoses) -> PoseLog:
    return PoseLog(bodies, "tracker.csv")


def test_noise_at_rest_is_that_which_was_planted(rng: np.random.Generator) -> None:
    found = measure_log_profile(log_of(resting(rng, 200.0)))
    noise, timing = found.noise.all_stations, found.timing.all_stations
    assert noise["components.white.position_m"].value == pytest.approx(WHITE_M, rel=0.08)
    assert noise["components.drift.position_m"].contains(DRIFT_M)
    assert noise["components.drift.correlation_s"].contains(CORRELATION_S)
    assert noise["components.white.orientation_rad"].value == pytest.approx(0.0006, rel=0.08)
    assert len(found.rest) == 2  # on both sides of the pause
    assert timing["timing.rate_hz"].value == pytest.approx(1.0 / 0.01665, rel=0.02)
    assert timing["timing.lost_share"].value == pytest.approx(0.02, abs=0.006)
    assert "no clock of a host" in timing["components.clock.drift_ppm"].reason
    said = " ".join(found.limits)
    assert "unevenly" in said
    assert "noise at rest is that of the nearest poses at an even" in said


def test_marks_say_where_rests_and_motion_count(rng: np.random.Generator) -> None:
    """A hand holds the body for 40 of 100 s; only the others are rests, and the covered ones are apart."""
    body = resting(rng, 100.0)
    held = (body.times_s > 40.0) & (body.times_s < 80.0)
    place = body.positions_m + np.where(held, 0.004, 0.0)[:, None] * rng.normal(size=body.positions_m.shape)
    log = log_of(replace(body, positions_m=place))
    marks = [(0.0, "static"), (40.0, "slow"), (80.0, "static"), (110.0, "covered")]
    found = measure_log_profile(log, marks)
    assert found.noise.all_stations["components.white.position_m"].value == pytest.approx(WHITE_M, rel=0.15)
    lengths = {one.name: one.duration_s for one in found.stretches}
    assert lengths == pytest.approx({"static": 70.0, "slow": 40.0, "covered": log.duration_s - 110.0})
    assert sum(one.records for one in found.stretches) == len(body.times_s)
    assert max(one.duration_s for one in found.rest) < 41.0
    missing = measure_log_profile(log, [(0.0, "slow")]).noise.all_stations["components.white.position_m"]
    assert missing.reason == "No body rests for 10 s in a stretch that is marked static, or not marked."


def test_an_even_series_takes_the_nearest_pose_and_leaves_few_holes(rng: np.random.Generator) -> None:
    body = resting(rng, 60.0)
    found = even_series(body, np.ones(len(body.times_s), bool))
    assert len(found.parts) == 2
    assert found.rate_hz < 60.0
    for part in found.parts:
        known = np.isfinite(part.quality)
        assert known.mean() > 0.95
        np.testing.assert_allclose(np.diff(part.measured_s), 1.0 / found.rate_hz)
        rows = np.searchsorted(body.times_s, part.measured_s[known])
        near = np.minimum(
            np.abs(body.times_s[np.clip(rows, 0, len(body.times_s) - 1)] - part.measured_s[known]),
            np.abs(body.times_s[np.clip(rows - 1, 0, None)] - part.measured_s[known]),
        )
        assert near.max() <= 0.5 / found.rate_hz + 1e-9
    assert found.left_out == pytest.approx(
        1.0 - sum(np.isfinite(p.quality).sum() for p in found.parts) / len(body.times_s)
    )


def test_repeats_are_counted_and_left_out_of_the_noise(rng: np.random.Generator) -> None:
    """Every sixth pose repeats the one before, as the source had no new one."""
    time_s, place, turn = moving(rng, 0.002)
    again = np.arange(len(time_s)) % 6 == 5
    place[again], turn[again] = place[np.flatnonzero(again) - 1], turn[np.flatnonzero(again) - 1]
    body = BodyPoses("hand", time_s, place, turn)
    np.testing.assert_array_equal(body.repeats, again)
    found = measure_log_profile(log_of(body))
    assert found.timing.all_stations["timing.duplicate_share"].value == pytest.approx(again.mean())
    assert any("repeat the one before" in note for note in found.limits)
    assert found.noise.all_stations["components.white.position_m"].reason == "No body rests for 10 s."
    assert neighbour_noise(body, ~again)[0] == pytest.approx(0.002, rel=0.1)


def test_noise_in_motion_is_bounded_at_uneven_times(rng: np.random.Generator) -> None:
    time_s, place, turn = moving(rng, 0.001)
    turn = rotations.multiply(turn, rotations.exp(0.002 * rng.normal(size=place.shape)))
    place_m, turn_rad = neighbour_noise(BodyPoses("hand", time_s, place, turn), np.ones(len(time_s), bool))
    assert place_m == pytest.approx(0.001, rel=0.1)
    assert turn_rad == pytest.approx(0.002, rel=0.1)
    notes = measure_log_profile(log_of(BodyPoses("hand", time_s, place, turn))).limits
    assert any(f"scatter is {1e3 * place_m:.3g} mm" in note and "fast motion included" in note for note in notes)


def test_a_moving_bar_shows_bias_and_budget_of_its_length(rng: np.random.Generator) -> None:
    """ASTM E3064: a bar of 300 mm that the tracker reports 0.4 % too long."""
    time_s, place, turn = moving(rng, 0.0, 120.0)
    first, second = (
        1.004 * point + 0.0008 * rng.normal(size=place.shape)
        for point in (place, place + rotations.rotate(turn, np.array([0.3, 0.0, 0.0])))
    )
    log = log_of(BodyPoses("a", time_s, first, turn), BodyPoses("b", time_s, second, turn))
    found = measure_log_profile(log, bar=Bar(("a", "b"), (0.3, 5e-5))).rigid
    assert found is not None
    assert found.budget.bias.contains(0.0012)
    assert found.budget.bias.high - found.budget.bias.low >= 4.0 * 5e-5 * 0.97
    names = [one.name for one in found.budget.components]
    assert names == ["repeatability", "change over the volume", "stated length"]
    assert found.budget.components[0].standard == pytest.approx(0.0008 * math.sqrt(2.0) * 1.0, rel=0.1)
    assert len(found.places) == 4
    assert all(one.length_m.contains(0.3012) for one in found.places)
    unstated = measure_log_profile(log, bar=Bar(("a", "b"))).rigid
    assert unstated is not None
    assert "--length" in unstated.budget.bias.reason


def test_the_budget_follows_the_gum() -> None:
    """Coverage factor by Welch and Satterthwaite: GUM, example H.1.6, has 16 degrees of freedom."""
    parts = (
        BudgetComponent("comparison", 9.7, "A", 25.6),
        BudgetComponent("coefficient", 2.9, "B", 50.0),
        BudgetComponent("standard", 25.0, "B", 18.0),
        BudgetComponent("difference", 16.6, "B", 2.0),
    )
    budget = UncertaintyBudget("length", "nm", parts, Interval(-4.0, -6.0, -2.0))
    assert budget.combined == pytest.approx(31.7, abs=0.1)
    assert budget.freedom == pytest.approx(16.7, abs=0.6)
    assert budget.coverage_factor == pytest.approx(2.11, abs=0.01)
    assert budget.expanded == pytest.approx(budget.coverage_factor * budget.combined + 4.0)
    exact = UncertaintyBudget("length", "nm", parts[:0], Interval.missing("none"))
    assert (exact.combined, exact.expanded) == (0.0, 0.0)


def rests(points_m: Floats, noise_m: float, rng: np.random.Generator, factor: float = 1.0) -> list[RestPlace]:
    """Rests on points, in a room that is turned, out of order."""
    room = rotations.exp(np.array([0.3, 0.2, 1.0]))
    found_m = (
        factor * rotations.rotate(room, points_m)
        + np.array([1.0, 2.0, 0.5])
        + noise_m * rng.normal(size=points_m.shape)
    )
    out = [RestPlace("probe", 10.0 * i, place, np.full(3, 0.0005), 300) for i, place in enumerate(found_m)]
    return out[::-1]


POINTS_M = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0.8], [0, 0, 0.8], [1, 1, 0.8]], dtype=float
)


def test_rests_on_surveyed_points_show_errors_scale_and_budget() -> None:
    """ASTM E2919, in 200 surveys: the RMS distance is that of the planted errors, and the scale in its interval."""
    rng = np.random.default_rng(3)
    found = [compare_with_survey(rests(POINTS_M, 0.002, rng), POINTS_M) for _ in range(200)]
    assert np.sqrt(np.mean([one.rms_m.value**2 for one in found])) == pytest.approx(0.002 * math.sqrt(3.0), rel=0.15)
    assert np.mean([one.scale.contains(0.0) for one in found]) >= 0.9
    assert compare_with_survey(rests(POINTS_M, 1e-4, rng, 1.003), POINTS_M).scale.value == pytest.approx(
        0.003, abs=5e-4
    )
    assert found[0].errors_m.shape == (7, 3)
    assert [one.name for one in found[0].budget.components] == ["repeatability", "change over the volume"]
    assert found[0].budget.components[0].standard == pytest.approx(0.0005)
    assert compare_with_survey(rests(POINTS_M, 0.0, rng), POINTS_M, 1e-4).budget.components[2].standard == 1e-4


def test_surveys_that_fix_nothing_are_refused(rng: np.random.Generator) -> None:
    line = np.outer(np.arange(5.0), np.array([1.0, 0.5, 0.0]))
    for places, points, words in (
        (rests(POINTS_M, 0.0, rng), POINTS_M[:5], "7 rests for 5 surveyed points .* 10 s or more on each"),
        (rests(POINTS_M[:3], 0.0, rng), POINTS_M[:3], "At least 4"),
        (rests(line, 0.0, rng), line, "lie on one line"),
        (
            [*rests(POINTS_M[:3], 0.0, rng), RestPlace("other", 0.0, np.zeros(3), np.zeros(3), 9)],
            POINTS_M[:4],
            "other, probe rest",
        ),
    ):
        with pytest.raises(BadInput, match=words):
            compare_with_survey(places, points)


def test_a_source_is_described_by_its_steps(rng: np.random.Generator) -> None:
    even = np.delete(np.arange(0.0, 10.0, 0.01), slice(300, 400))
    assert (
        describe_sampling("a", even)
        == "a: 900 poses, evenly, every 10.0 ms in the mean (90 % of the steps: 10 to 10 ms), without 1.0 of 10.0 s."
    )
    assert "unevenly" in describe_sampling("a", resting_times(rng, 20.0))
    assert describe_sampling("a", np.zeros(1)) == "a: 1 pose."


def test_a_log_of_few_poses_is_refused() -> None:
    body = BodyPoses("a", np.arange(5.0), np.zeros((5, 3)), np.tile(rotations.IDENTITY, (5, 1)))
    with pytest.raises(BadInput, match="no body with 20 poses"):
        measure_log_profile(log_of(body))


def test_steps_that_are_equal_show_no_resolution_and_no_jitter(rng: np.random.Generator) -> None:
    body = resting(rng, 30.0)
    even = BodyPoses("tracker", 0.02 * np.arange(float(len(body.times_s))), body.positions_m, body.quaternions)
    timing = measure_log_profile(log_of(even)).timing.all_stations
    assert timing["timing.jitter_s"].value == 0.0
    assert "equal" in timing["timing.stamp_resolution_s"].reason
    unix_s = 1.68e9 + even.times_s
    stored = BodyPoses("tracker", unix_s - unix_s[0], even.positions_m, even.quaternions)
    timing = measure_log_profile(replace(log_of(stored), start_unix_s=1.68e9)).timing.all_stations
    assert (timing["timing.jitter_s"].value, timing["timing.stamp_resolution_s"].is_measured) == (0.0, False)
    rounded = BodyPoses("tracker", np.round(even.times_s * 0.75, 2), even.positions_m, even.quaternions)
    timing = measure_log_profile(log_of(rounded)).timing.all_stations
    assert timing["timing.stamp_resolution_s"].value == 0.01
    assert timing["timing.jitter_s"].value == pytest.approx(0.005, rel=0.05)


def test_the_resolution_of_unix_times_is_found_beside_their_rounding(rng: np.random.Generator) -> None:
    body = resting(rng, 30.0)
    unix_s = np.round(1.7e9 + body.times_s, 4)
    log = replace(log_of(replace(body, times_s=unix_s - unix_s[0])), start_unix_s=float(unix_s[0]))
    assert measure_log_profile(log).timing.all_stations["timing.stamp_resolution_s"].value == 1e-4


def test_a_rest_is_long_enough_where_nothing_drifts(rng: np.random.Generator) -> None:
    """The correlation time of a drift of zero is any number."""
    time_s = np.arange(6000.0) / 50.0
    turn = rotations.exp(0.0006 * rng.normal(size=(6000, 3)))
    for drift_m, words in ((0.0, False), (0.002, True)):
        place = WHITE_M * rng.normal(size=(6000, 3)) + drift_m * np.sin(0.1 * time_s)[:, None]
        limits = measure_log_profile(log_of(BodyPoses("tracker", time_s, place, turn))).limits
        assert any("rest for longer" in limit for limit in limits) == words


def test_times_that_were_counted_measure_no_clock(rng: np.random.Generator) -> None:
    log = replace(log_of(resting(rng, 30.0)), clock="samples counted at 60 Hz")
    found = measure_log_profile(log)
    for timing in (found.timing.all_stations, found.timing.by_station["tracker"]):
        for key in ("timing.rate_hz", "timing.jitter_s", "timing.lost_share"):
            assert timing[key].reason == "The source has no times: samples counted at 60 Hz."
        assert timing["timing.duplicate_share"].is_measured
    assert "no times" in found.timing.all_stations["timing.stamp_resolution_s"].reason
    assert found.limits[0].endswith("poses without times, samples counted at 60 Hz.")
