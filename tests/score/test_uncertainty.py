"""Scores of standard deviations: by hand, for errors that are what they are stated to be, and in the hinges' order."""

import numpy as np
import pytest
from scipy.stats import t as student_t

from harness.core.arrays import Floats
from harness.core.estimate import HALF_WIDTH_95, SIGMA_FREEDOM
from harness.core.humanoid24 import pack, standard_skeleton, unpack
from harness.errors import ShapeError
from harness.score.uncertainty import SIGMA_DEFINITIONS, sum_sigma
from tests.scored_run import Judge


def test_scores_by_hand() -> None:
    """Two hinges, three frames: coverage 2/3 and 1/3 at one, 3/3 and 2/3 at two."""
    error_deg = np.array([[1.0, 0.0], [2.0, 9.0], [3.9, 3.0]])
    sigma_deg = np.array([[1.0, 1.0], [2.5, 4.0], [2.0, 2.0]])
    scores = sum_sigma(error_deg, sigma_deg).scores()
    assert set(scores) == set(SIGMA_DEFINITIONS)
    assert scores["sigma_coverage_1"] == pytest.approx(3 / 6)
    assert scores["sigma_coverage_2"] == pytest.approx(5 / 6)
    assert scores["sigma_coverage_95"] == pytest.approx(6 / 6)
    assert scores["sigma_lowest_coverage_1"] == pytest.approx(1 / 3)
    assert scores["sigma_width_deg"] == pytest.approx(12.5 / 6)
    expected = [np.log(s * np.sqrt(2 * np.pi)) + e**2 / (2 * s**2) for e, s in zip(error_deg.flat, sigma_deg.flat)]  # noqa: B905
    assert scores["sigma_log_score"] == pytest.approx(np.mean(expected))


def test_clips_are_pooled_by_frames(rng: np.random.Generator) -> None:
    error_deg, sigma_deg = rng.gamma(2.0, 1.0, (90, 48)), rng.uniform(1.0, 3.0, (90, 48))
    whole = sum_sigma(error_deg, sigma_deg).scores()
    parts = sum_sigma(error_deg[:7], sigma_deg[:7]) + sum_sigma(error_deg[7:], sigma_deg[7:])
    assert parts.frames == 90
    assert parts.scores() == pytest.approx(whole)


def test_normal_errors_have_the_shares_of_a_normal_distribution(rng: np.random.Generator) -> None:
    sigma_deg = rng.uniform(0.5, 10.0, (20_000, 4))
    error_deg = np.abs(rng.normal(size=sigma_deg.shape)) * sigma_deg
    scores = sum_sigma(error_deg, sigma_deg).scores()
    assert scores["sigma_coverage_1"] == pytest.approx(0.6827, abs=0.005)
    assert scores["sigma_coverage_2"] == pytest.approx(0.9545, abs=0.005)
    for factor in (0.7, 1.4):
        assert sum_sigma(error_deg, factor * sigma_deg).scores()["sigma_log_score"] > scores["sigma_log_score"]


def test_the_region_of_95_percent_is_that_of_students_t(rng: np.random.Generator) -> None:
    of = student_t(SIGMA_FREEDOM)
    assert of.ppf(0.975) / of.ppf(0.5 + 0.5 * 0.6827) == pytest.approx(HALF_WIDTH_95, abs=1e-3)
    error_deg = np.abs(rng.standard_t(SIGMA_FREEDOM, (20_000, 4)))
    scores = sum_sigma(error_deg, np.full(error_deg.shape, of.ppf(0.5 + 0.5 * 0.6827))).scores()
    assert (scores["sigma_coverage_1"], scores["sigma_coverage_95"]) == pytest.approx((0.6827, 0.95), abs=0.005)


def test_nothing_is_scored_without_frames() -> None:
    nothing = sum_sigma(np.zeros((0, 48)), np.zeros((0, 48)))
    assert (nothing.scores(), nothing.by_hinge()) == ({}, {})
    with pytest.raises(ShapeError, match="sigma_deg"):
        sum_sigma(np.zeros((3, 48)), np.zeros((3, 47)))


def test_a_standard_deviation_belongs_to_the_hinge_at_its_place_in_the_configuration(
    truth_qpos: Floats, judge: Judge
) -> None:
    """Errors of 0.1 rad at one hinge after the other, past +-pi, and a deviation that is wide at that hinge alone."""
    names = standard_skeleton().dof_names
    for place in (0, 9, 31, 47):
        estimate, sigma_rad = truth_qpos.copy(), np.full((400, 48), 0.01)
        estimate[:, 7:] += 0.1
        estimate[:, 7 + place] += 2.0 * np.pi
        sigma_rad[:, place] = 0.2
        scores = judge(estimate, angle_sigma_rad=sigma_rad)
        covered = {name: share for name, share in scores.per_joint["sigma_coverage_1"].items() if share}
        marked = np.zeros(55)
        marked[7 + place] = 1.0
        ((hinge,),) = np.nonzero(unpack(marked)[2])
        assert covered == {names[hinge]: 1.0}
        assert scores.sigma["sigma_coverage_1"] == pytest.approx(1 / 48)
        assert scores.sigma["sigma_lowest_coverage_1"] == 0.0


def test_only_scored_frames_count(truth_qpos: Floats, judge: Judge) -> None:
    root_m, turn, angles_rad = unpack(truth_qpos)
    angles_rad = angles_rad.copy()
    angles_rad[:40] += 1.0
    estimate, sigma_rad = pack(root_m, turn, angles_rad), np.full((400, 48), 0.1)
    assert judge(estimate, angle_sigma_rad=sigma_rad).sigma["sigma_coverage_1"] == pytest.approx(0.9)
    assert judge(estimate, angle_sigma_rad=sigma_rad, warm_up_s=1.0).sigma["sigma_coverage_1"] == 1.0
    estimate[:40] = np.nan
    assert judge(estimate, angle_sigma_rad=sigma_rad).sigma["sigma_coverage_1"] == 1.0
    assert judge(estimate[:100], angle_sigma_rad=sigma_rad[:100]).sigma == {}, "below the floor of coverage"
    assert judge(estimate).sigma == {}
    with pytest.raises(ShapeError, match="angle_sigma_rad"):
        judge(estimate, angle_sigma_rad=sigma_rad[:, :47])
