"""Errors of the physical simulation beside those of `noise = "default"`, on the same motion, for the page."""

from collections.abc import Iterator, Sequence

import numpy as np

from harness.bench.physics.error_statistics import RecordedErrors, error_statistics
from harness.bench.physics.speed import MOUNTS, PHYSICAL
from harness.body import retargeting
from harness.core.progress import ProgressCallback
from harness.mocap import synthetic
from harness.report.physics.error_comparison import TrackerErrorStatistics
from harness.simulate.noise import Noise, noise_preset
from harness.simulate.simulation import TrackerConfig, sampling_times_s, simulate_readings
from harness.simulate.trajectory import Trajectory

_STATIONS, _SECONDS = 6, 60.0
_TRACKER = TrackerConfig()


def compare_error_models(
    seeds: Sequence[int], progress: ProgressCallback = lambda model, done, of: None
) -> tuple[TrackerErrorStatistics, ...]:
    """Statistics of both error models on built-in boxing, one take of each seed, with six stations."""
    out = []
    models = {"physics": PHYSICAL, 'noise = "default"': noise_preset("default")}
    source = (
        f"{len(seeds)} takes of built-in boxing of {_SECONDS:.0f} s, {_STATIONS} stations at {_TRACKER.rate_hz:g} Hz"
    )
    for done, (label, noise) in enumerate(models.items()):
        progress(f"errors of {label}", done, len(models))
        out.append(error_statistics(label, f"{source}.", _recordings(seeds, noise)))
    progress("", len(models), len(models))
    return tuple(out)


def _recordings(seeds: Sequence[int], noise: Noise) -> Iterator[RecordedErrors]:
    performers = synthetic.REFERENCE_PERFORMERS
    for seed in seeds:
        performer = performers[seed % len(performers)]
        clip = synthetic.generate("boxing", performer, 1, seed=seed, duration_s=_SECONDS)
        body, take = retargeting.retarget_to_own_body(clip)
        trajectory, mounts = Trajectory(body, take), MOUNTS[:_STATIONS]
        time_s = sampling_times_s(trajectory.duration_s, _TRACKER, _STATIONS)
        found, true = (
            simulate_readings(trajectory, mounts, _TRACKER, model, time_s, seed=seed, take=take.name)
            for model in (noise, noise_preset("clean"))
        )
        yield RecordedErrors(np.asarray(time_s[:, 0]), found.position_m - true.position_m, found.quality)
