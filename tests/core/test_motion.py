"""Spans of time that are too long for an array, and times that are no seconds, with the cause that is named."""

import numpy as np
import pytest

from harness.core.motion import MOST_STEPS, Clip, count_steps, require_rate, require_seconds
from harness.errors import BadInput
from tests.mocap.sample_files import clip

MOTION_S = np.arange(2400) / 120.0


def test_a_span_has_its_number_of_steps_up_to_a_limit() -> None:
    assert count_steps(10.0, 0.025, "x") == 400
    assert count_steps(float(MOST_STEPS), 1.0, "x") == MOST_STEPS
    for span_s, step_s in ((MOST_STEPS + 1.0, 1.0), (1e18, 0.025), (np.nan, 1.0), (np.inf, 1.0)):
        with pytest.raises(BadInput, match=r"The capture: .* Likely cause: times in another unit"):
            count_steps(span_s, step_s, "The capture")


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")])
@pytest.mark.parametrize("rate_hz", [10.0, 40.0, 120.0, 900.0])
def test_the_unit_of_other_times_is_named(factor: float, unit: str, rate_hz: float) -> None:
    if rate_hz == 900.0 and factor == 1e3:
        factor *= 2.0  # milliseconds of a fast reference are a motion of one pose a second
    with pytest.raises(BadInput, match=f"in {unit} instead of seconds"):
        require_seconds(factor * np.arange(100, dtype=np.float64) / rate_hz, "The reference")


@pytest.mark.parametrize("place", [0, 7, 2399])
def test_one_stray_time_is_named(place: int) -> None:
    time_s = 1.7e9 + MOTION_S
    time_s[place] = 0.0 if place < 2399 else 1e18
    with pytest.raises(BadInput, match=r"jump from .* a stray time") as refused:
        require_seconds(np.sort(time_s), "The reference")
    assert f"after pose {2399 if place == 2399 else 1} of 2400" in str(refused.value)


@pytest.mark.parametrize("start_s", [-5.0, 0.0, 1.7e9])
def test_seconds_are_accepted_from_any_start_and_with_gaps(start_s: float) -> None:
    require_seconds(start_s + MOTION_S, "The reference")
    require_seconds(start_s + np.concatenate([MOTION_S, 3600.0 + MOTION_S]), "The reference")
    require_seconds(start_s + np.arange(50.0), "The reference")
    require_seconds(np.zeros(0), "The reference")


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, 1e-6, 1e6, np.nan, np.inf])
def test_a_motion_has_a_rate_that_it_can_have(rate_hz: float) -> None:
    with pytest.raises(BadInput, match="correct its frame rate"):
        require_rate(rate_hz, 24, "91_01")
    with pytest.raises(BadInput, match="91_01: 24 frames"):
        _clip_at(rate_hz)
    assert _clip_at(1.0).duration_s == 23.0


def _clip_at(rate_hz: float) -> Clip:
    one = clip()
    return Clip("91_01", "91", "", "", one.skeleton, rate_hz, one.root_m, one.world_from_root, one.angles_rad)
