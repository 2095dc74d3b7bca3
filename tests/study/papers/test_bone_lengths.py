"""Modes of bone lengths keep the laws of principal directions."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.humanoid24 import BONES
from harness.mocap import synthetic
from harness.study.papers.bone_lengths import (
    MODES,
    explained_variance_by_count,
    fit_eigenmodes,
    leave_one_out_errors_m,
    normalise_by_tibia,
    symmetrise,
)


def _lengths_m(people: int, seed: int = 1) -> Floats:
    return np.array([person.length_m for person in synthetic.sample_skeletons(people, seed)])


def test_modes_of_a_plane_are_two_and_find_its_axes(rng: np.random.Generator) -> None:
    axes = np.linalg.qr(rng.normal(size=(9, 2)))[0].T
    weights = rng.normal(size=(4_000, 2)) * [3.0, 0.5]
    found = fit_eigenmodes(7.0 + weights @ axes)
    assert found.explained[0] == pytest.approx(9.0 / 9.25, abs=0.01)
    assert found.explained[1] == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(found.spread[:2], [3.0, 0.5], rtol=0.05)
    assert np.abs(np.vecdot(found.modes[:2], axes)).min() > 0.99


@pytest.mark.parametrize("people", [7, 20, 60])
def test_shares_grow_to_one_and_units_do_not_matter(people: int) -> None:
    length_m = _lengths_m(people)
    found = fit_eigenmodes(length_m)
    assert np.all(np.diff(found.explained) >= -1e-12)
    assert found.explained[-1] == pytest.approx(1.0)
    np.testing.assert_allclose(fit_eigenmodes(1e3 * length_m).explained, found.explained, atol=1e-12)
    np.testing.assert_allclose(found.modes @ found.modes.T, np.eye(len(found.modes)), atol=1e-10)
    largest = np.take_along_axis(found.modes, np.abs(found.modes).argmax(axis=1, keepdims=True), axis=1)
    assert np.all(largest > 0.0)


def test_stature_vanishes_by_the_tibia_and_sides_by_the_mirror() -> None:
    person = _lengths_m(1)[0]
    tall = person * np.linspace(0.9, 1.1, 12)[:, None]
    np.testing.assert_allclose(np.ptp(normalise_by_tibia(tall), axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(normalise_by_tibia(tall)[:, BONES.index("ltibia")], 1.0)
    uneven = tall * np.where([name == "lhand" for name in BONES], 1.4, 1.0)
    even = symmetrise(uneven)
    np.testing.assert_allclose(even[:, BONES.index("lhand")], even[:, BONES.index("rhand")])
    others = [b for b, name in enumerate(BONES) if not name.endswith("hand")]
    np.testing.assert_allclose(even[:, others], tall[:, others])


def test_a_person_left_out_is_told_by_the_others_alone(rng: np.random.Generator) -> None:
    length_m = _lengths_m(12)
    others = np.delete(length_m, 4, axis=0)
    np.testing.assert_allclose(leave_one_out_errors_m(length_m, 0)[4], length_m[4] - others.mean(axis=0), atol=1e-12)
    rms_m = [float(np.sqrt(np.mean(leave_one_out_errors_m(length_m, modes) ** 2))) for modes in range(11)]
    assert np.all(np.diff(rms_m) <= 1e-12), "a mode more made it worse"
    flat = length_m.mean(axis=0) + rng.normal(size=(12, 3)) @ rng.normal(size=(3, 24))
    assert np.abs(leave_one_out_errors_m(flat, 3)).max() < 1e-9


def test_fewer_people_leave_less_to_lose() -> None:
    length_m = _lengths_m(16)
    shares = explained_variance_by_count(length_m, range(6, 17), seed=1)
    assert np.all(np.diff(shares, axis=1) >= 0.0)
    np.testing.assert_allclose(shares[0], 1.0, atol=1e-9)
    assert np.all(np.diff(shares[:, 1]) < 0.005)
    np.testing.assert_allclose(shares[-1], fit_eigenmodes(length_m).explained[MODES - 1], atol=1e-9)
