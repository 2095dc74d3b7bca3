"""The prior of people's bones."""

import numpy as np
import pytest

from harness.calibrate.skeleton_prior import LEAST_RESIDUAL_SD_M, SkeletonPrior, fit_skeleton_prior
from harness.core.humanoid24 import standard_skeleton
from harness.errors import BadInput
from harness.mocap.synthetic import sample_skeletons
from tests.calibrate.standing_model import straightened

PEOPLE = sample_skeletons(60, seed=5)


def test_left_and_right_are_alike() -> None:
    found, names = fit_skeleton_prior(PEOPLE, 5), PEOPLE[0].names
    left = [b for b, name in enumerate(names) if f"r{name[1:]}" in names and name[0] == "l"]
    right = [names.index(f"r{names[b][1:]}") for b in left]
    np.testing.assert_allclose(found.mean_m[left], found.mean_m[right], atol=1e-12)
    np.testing.assert_allclose(found.covariance_m2[left][:, left], found.covariance_m2[right][:, right], atol=1e-12)
    np.testing.assert_allclose(found.direction[left] * [1.0, -1.0, 1.0], found.direction[right], atol=1e-12)


def explained_variance(prior: SkeletonPrior) -> float:
    """Share of the variance of the lengths that the modes explain."""
    modes = float(np.sum(prior.mode_sd_m**2))
    return modes / (modes + float(np.sum(prior.residual_sd_m**2)))


@pytest.mark.parametrize("modes", [0, 1, 5, 24])
def test_modes_and_rest_make_up_the_spread(modes: int) -> None:
    """The residual variance is that of the population times n / (n - modes)."""
    found = fit_skeleton_prior(PEOPLE, modes)
    lengths = np.array([skeleton.length_m for skeleton in PEOPLE])
    pooled = np.concatenate([lengths, lengths])  # built-in performers are mirror images of themselves
    whole = np.sum((pooled - pooled.mean(axis=0)) ** 2, axis=0) / (2 * (len(PEOPLE) - 1))
    kept = np.diag((found.modes.T * found.mode_sd_m**2) @ found.modes)
    expected = np.maximum((whole - kept) * len(PEOPLE) / (len(PEOPLE) - modes), LEAST_RESIDUAL_SD_M**2)
    np.testing.assert_allclose(found.residual_sd_m**2, expected, atol=1e-12)
    np.testing.assert_allclose(found.modes @ found.modes.T, np.eye(modes), atol=1e-12)
    assert 0.0 <= explained_variance(found) <= 1.0


def test_more_modes_keep_more() -> None:
    kept = [explained_variance(fit_skeleton_prior(PEOPLE, modes)) for modes in range(8)]
    assert kept[0] == 0.0
    assert all(np.diff(kept) > 0.0)
    assert kept[5] > 0.85


def test_two_axes_square_to_each_bone() -> None:
    found = fit_skeleton_prior(PEOPLE)
    frames = np.concatenate([found.direction[:, None], found.across], axis=1)
    np.testing.assert_allclose(frames @ np.swapaxes(frames, 1, 2), np.tile(np.eye(3), (24, 1, 1)), atol=1e-9)


def test_how_far_bones_point_elsewhere_is_learnt() -> None:
    names = PEOPLE[0].names
    found, none = fit_skeleton_prior(PEOPLE), fit_skeleton_prior([straightened(skeleton) for skeleton in PEOPLE])
    clavicle = names.index("lclavicle")
    assert found.across_m[clavicle].max() == pytest.approx(0.05 * 0.19, rel=0.3)  # 0.05 rad of 0.19 m, drawn clipped
    assert found.across_m[names.index("lfemur")].max() < 1e-9
    assert none.across_m.max() < 1e-9
    np.testing.assert_allclose(
        none.direction, standard_skeleton().bone_m / standard_skeleton().length_m[:, None], atol=1e-12
    )


def test_the_mean_skeleton_has_mean_bones() -> None:
    found = fit_skeleton_prior(PEOPLE)
    np.testing.assert_allclose(found.mean_skeleton(standard_skeleton()).length_m, found.mean_m, atol=1e-12)


def test_modes_help_to_guess_an_arm_of_somebody_else() -> None:
    """The humerus is predicted from the other bones better than by its mean, for people outside the population."""
    found, others = fit_skeleton_prior(PEOPLE, 5), sample_skeletons(40, seed=6)
    arm, rest = [7, 13], [b for b in range(24) if b not in (7, 13)]
    off_m = np.array([skeleton.length_m for skeleton in others]) - found.mean_m
    spread = found.covariance_m2
    guess = off_m[:, rest] @ np.linalg.solve(spread[np.ix_(rest, rest)], spread[np.ix_(rest, arm)])
    assert np.mean((off_m[:, arm] - guess) ** 2) < 0.8 * np.mean(off_m[:, arm] ** 2)


def test_too_few_people_are_refused() -> None:
    with pytest.raises(BadInput, match="6 skeletons are too few for 5 modes"):
        fit_skeleton_prior(PEOPLE[:6])
    with pytest.raises(BadInput, match="different bones"):
        fit_skeleton_prior([*PEOPLE[:8], PEOPLE[0].subset(PEOPLE[0].names[:6])[0]])
