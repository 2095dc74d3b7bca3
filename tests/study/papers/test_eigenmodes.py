"""The experiment on modes of bone lengths: drawn people, too few, and 20 real ones."""

from pathlib import Path

import numpy as np
import pytest

from harness.core.humanoid24 import BONES
from harness.errors import BadInput
from harness.mocap import synthetic
from harness.mocap.sources import read_skeletons
from harness.results.findings import BarChart, LineChart
from harness.study.papers.bone_lengths import MODES, fit_eigenmodes, leave_one_out_errors_m, normalise_by_tibia
from harness.study.papers.eigenmodes import evaluate_bone_modes


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
