"""The filter against a plain one written apart, and its consistency over matched runs."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from harness.core import rotations
from harness.core.arrays import Floats
from harness.simulate.physics.filter_settings import Fusion
from harness.simulate.physics.fusion import FusionFilter
from harness.simulate.physics.inertial import Inertial
from harness.simulate.physics.sound import Sound
from tests.simulate.physics.free_station import (
    EXACT,
    FIRST_SIGMA,
    FreeStation,
    exact_inertial,
    free_station,
    new_filter,
    noisy,
    records_every,
    run,
    start,
    true_error,
)
from tests.simulate.physics.reference_filter import ReferenceFilter
from tests.simulate.physics.rooms import emitters_in_turn

RUNS = 50


def reference(fusion_filter: FusionFilter, fusion: Fusion) -> ReferenceFilter:
    """The plain filter in the state of the only station."""
    state, inertial = fusion_filter.state, Inertial()
    motion = state.motion[0, -1].copy()
    out = ReferenceFilter(
        motion[:3],
        motion[3:6],
        Rotation.from_quat(motion[6:], scalar_first=True),
        state.covariance[0].copy(),
        np.array(Sound().microphones_m) - np.array(inertial.lever_m),
        fusion_filter.model.noise,
    )
    out.scale, out.range_scale, out.survey = fusion.inertial_scale, fusion.range_scale, fusion.survey_m
    return out


@pytest.mark.parametrize("fusion", [EXACT, Fusion()], ids=["exact", "default"])
def test_equals_a_plain_filter_written_apart(fusion: Fusion, rng: np.random.Generator) -> None:
    station, _ = noisy(free_station(3.0, 5, speed=1.5), 5, Inertial())
    station.range_m[40::17, 0] = np.nan
    station.range_m[45::31, 1] += 0.3  # beyond the gate
    kernel = new_filter(fusion=fusion)
    start(kernel, station, FIRST_SIGMA * rng.standard_normal(15))
    plain = reference(kernel, fusion)
    for slot, ranges in enumerate(station.range_m):
        span = slice(5 * slot, 5 * slot + 5)
        outputs = records_every(5, 0)
        kernel.filter_block(
            slot,
            emitters_in_turn(slot, 1),
            station.angle_rad[span, None],
            station.gain_m_s[span, None],
            ranges[None, None],
            outputs,
        )
        plain.slot(station.angle_rad[span], station.gain_m_s[span], ranges, slot % 9)
        motion = kernel.state.motion[0, -1]
        np.testing.assert_allclose(motion[:3], plain.position, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(motion[3:6], plain.velocity, rtol=0.0, atol=1e-9)
        turned = rotations.angle_between_rad(motion[6:], plain.attitude.as_quat(scalar_first=True))
        assert turned < 1e-9
        np.testing.assert_allclose(kernel.state.bias[0], plain.bias, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(kernel.state.covariance[0], plain.covariance, rtol=0.0, atol=1e-9)
    rejected = kernel.state.counts[1, 0].sum()
    assert rejected > 0


def matched_runs(change: Callable[[FreeStation], FreeStation] = lambda station: station) -> tuple[float, float, float]:
    """Mean over 50 matched runs of NEES (15 numbers), NEES of the position, and NIS."""
    totals = np.zeros(3)
    inertial = exact_inertial()
    for seed in range(RUNS):
        truth = free_station(3.0, seed)
        station, biases = noisy(truth, seed, inertial)
        fusion_filter = new_filter(inertial=inertial)
        start(fusion_filter, station, FIRST_SIGMA * np.random.default_rng(seed).standard_normal(15))
        run(fusion_filter, change(station))
        error = true_error(fusion_filter, station, biases, len(station.range_m))
        covariance = fusion_filter.state.covariance[0]
        totals[0] += error @ np.linalg.solve(covariance, error)
        totals[1] += error[:3] @ np.linalg.solve(covariance[:3, :3], error[:3])
        totals[2] += fusion_filter.state.nis[0, 0] / fusion_filter.state.nis[0, 1]
        assert fusion_filter.state.status[0, 0] == 2
    return float(totals[0] / RUNS), float(totals[1] / RUNS), float(totals[2] / RUNS)


def test_errors_are_as_large_as_the_covariance_says() -> None:
    """Mean NEES and NIS lie in the 95 % interval of chi-square over 50 matched runs (Bar-Shalom 2001, 5.4.2)."""
    nees, nees_of_position, nis = matched_runs()
    print(f"NEES {nees:.2f} (15), of the position {nees_of_position:.2f} (3), NIS {nis:.4f} (1)")
    count = RUNS * 2 * 240
    for value, freedom, runs in ((nees, 15, RUNS), (nees_of_position, 3, RUNS), (nis, 1, count)):
        low, high = (float(stats.chi2.ppf(share, freedom * runs)) / runs for share in (0.025, 0.975))
        assert low < value < high, (freedom, value, low, high)


def test_wrong_noise_is_seen_in_the_normalised_errors() -> None:
    """Ranges with half as much noise again fall outside."""
    noisier = matched_runs(lambda s: replace(s, range_m=s.range_m + 1.1 * s.sigma_m * _normal(s)))
    assert noisier[2] > 1.5


def _normal(station: FreeStation) -> Floats:
    return np.random.default_rng(len(station.range_m)).standard_normal(station.range_m.shape)
