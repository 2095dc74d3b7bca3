"""Origin of estimates: which frames a method's model answered, which its fallback, and which nothing."""

import numpy as np
import pytest

from harness.body import build_body
from harness.core.estimate import Origin
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.reconstruct import registry
from harness.testing.frames import drop_stations, exact_calibration, exact_frames, swaying_motion

RATE_HZ = 40.0
SILENT = range(60, 90)
"""Frames without any reading: 0.75 s, longer than any history bridges."""


def origins_of(name: str) -> list[Origin]:
    """Origins of the estimates of 120 frames, of which `SILENT` have no reading."""
    body = build_body()
    calibration, method = exact_calibration(body), registry.make_method(name)
    examples = [BodyMotion(f"s{n}", "nobody", "s", "", RATE_HZ, swaying_motion(body, 160, n)) for n in (2, 3)]
    session = method.fit(body, examples, generator(1, "fit")).begin(calibration)
    frames = exact_frames(body, calibration, swaying_motion(body, 120), RATE_HZ)
    frames = [drop_stations(f, range(len(f.quality))) if i in SILENT else f for i, f in enumerate(frames)]
    return [session.step(frame).origin for frame in frames]


@pytest.mark.parametrize("name", ["dynamic_map:window", "local_pca"])
def test_inverse_kinematics_answers_until_there_is_a_history(name: str) -> None:
    """The cold start and the frames until the history is full are fallbacks; so are those after a long silence."""
    origins, history = origins_of(name), 2
    for first in (0, SILENT.stop):
        assert set(origins[first : first + history]) == {Origin.FALLBACK}
        assert origins[first + history] is Origin.MODEL
    assert {origins[i] for i in SILENT} == {Origin.BRIDGED}


@pytest.mark.parametrize(
    "name",
    [
        "ik",
        "dynamic_map",
        "mean_pose",
        "best_match",
        "kernel_ridge",
        "ridge",
        "kernel_cca",
        "weighted_blend",
        "weighted_blend+ik",
    ],
)
def test_methods_without_a_fallback_answer_every_frame_that_has_readings(name: str) -> None:
    origins = np.array(origins_of(name))
    silent = np.isin(np.arange(len(origins)), SILENT)
    assert set(origins[silent]) == {Origin.BRIDGED}
    assert set(origins[~silent]) == {Origin.MODEL}
