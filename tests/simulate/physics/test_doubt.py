"""A station whose position is too uncertain is reported as lost, and ranges make it sure again without a new fix."""

from dataclasses import replace

import numpy as np

from harness.body.mounts import DEFAULT_MOUNTS
from harness.body.retargeting import retarget_to_own_body
from harness.mocap import synthetic
from harness.simulate.noise import Noise, noise_preset
from harness.simulate.physics.settings import Physics
from harness.simulate.simulation import TrackerConfig, sampling_times_s, simulate_readings
from harness.simulate.trajectory import Trajectory


def test_an_ankle_that_hears_few_ranges_is_lost_for_moments_only() -> None:
    clip = synthetic.generate("walking", "p1", 1, seed=1, duration_s=8.0)
    body, take = retarget_to_own_body(clip)
    physics, tracker = Physics(), TrackerConfig()
    physics = replace(physics, constellation=replace(physics.constellation, name="hall"))
    trajectory, mounts = Trajectory(body, take), [DEFAULT_MOUNTS["right_ankle"]]
    time_s = sampling_times_s(trajectory.duration_s, tracker, 1)
    found, true = (
        simulate_readings(trajectory, mounts, tracker, noise, time_s, seed=1, take=take.name)
        for noise in (Noise(physics=physics), noise_preset("clean"))
    )
    lost = found.quality[:, 0] == 0.0
    assert found.filter is not None
    assert found.filter.hearing_share[0] > 0.95
    assert 0.0 < np.mean(lost) < 0.1
    error_m = np.linalg.norm(found.position_m - true.position_m, axis=-1)[:, 0]
    assert error_m[~lost].max() < 0.05
