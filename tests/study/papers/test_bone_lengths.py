"""Modes of bone lengths keep the laws of principal directions."""

from pathlib import Path

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.humanoid24 import BONES
from harness.errors import BadInput
from harness.mocap import read_skeletons, synthetic
from harness.results.findings import BarChart, LineChart
from harness.study.papers.bone_lengths import (
    MODES,
    evaluate_bone_modes,
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


def test_the_experiment_on_drawn_people_is_not_comparable() -> None:
    drawn = {str(which): person for which, person in enumerate(synthetic.sample_skeletons(20, 1))}
    told = evaluate_bone_modes(drawn, "drawn", measured=False, seed=1)
    assert told == evaluate_bone_modes(drawn, "drawn", measured=False, seed=1)
    (claim,) = told.claims
    assert claim.verdict == "not comparable"
    assert "synthetic" in claim.why
    modes, kept, counts, bones = told.figures
    assert isinstance(modes, BarChart)
    assert isinstance(bones, BarChart)
    assert set(map(len, modes.series.values())) == {len(BONES)}
    assert len(modes.series) == MODES
    assert isinstance(kept, LineChart)
    assert isinstance(counts, LineChart)
    assert kept.series["normalised by the left tibia"][MODES - 1] == pytest.approx(claim.value)
    assert all(len(row) == len(table.columns) for table in told.tables for row in table.rows)
    means = {name: np.mean(np.array(values, float)) for name, values in bones.series.items()}
    assert means["5 modes"] < 0.6 * means["the mean skeleton"]


def test_six_people_are_too_few() -> None:
    six = {str(which): person for which, person in enumerate(synthetic.sample_skeletons(6, 1))}
    with pytest.raises(BadInput, match="reproduce the bones of any 6 people exactly"):
        evaluate_bone_modes(six, "drawn", measured=True, seed=1)


def test_twenty_real_skeletons_lose_eight_times_what_the_paper_says(mocap: Path) -> None:
    people = read_skeletons(mocap)
    length_m = np.array([person.length_m for person in people.values()])
    assert len(length_m) == 20
    assert 0.90 < fit_eigenmodes(length_m).explained[MODES - 1] < 0.92
    assert 0.90 < fit_eigenmodes(normalise_by_tibia(length_m)).explained[MODES - 1] < 0.925
    (claim,) = evaluate_bone_modes(people, "CMU's", measured=True, seed=1).claims
    assert claim.verdict == "not reproduced"
    assert "is not explained" in claim.why
    rms_mm = [1e3 * np.sqrt(np.mean(leave_one_out_errors_m(length_m, modes) ** 2)) for modes in (0, MODES)]
    assert rms_mm[1] < 0.6 * rms_mm[0]
