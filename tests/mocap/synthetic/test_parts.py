"""Parts of the motion generator: smooth curves, limbs that reach their targets, feet that do not slide."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.mocap import synthetic
from harness.mocap.synthetic import curves, limb_ik
from harness.mocap.synthetic.curves import Gesture, keyframes_at, sum_gestures
from harness.mocap.synthetic.footwork import BALL_M, FootContact, flat_pitch_rad, plan_foot

STEP = 1e-3


def slopes(curve: Floats) -> tuple[Floats, Floats]:
    """First and second derivative of a curve sampled at STEP."""
    return np.diff(curve) / STEP, np.diff(curve, 2) / STEP**2


@pytest.mark.parametrize(
    "curve", [curves.minimum_jerk, curves.smooth_trapezoid, curves.pulse, lambda x: curves.pulse(x, 0.33)]
)
def test_steps_and_pulses_start_and_end_without_a_jolt(curve: object) -> None:
    x = np.arange(-0.5, 1.5, STEP)
    assert callable(curve)
    y = curve(x)
    speed, bend = slopes(y)
    assert np.all((y >= 0.0) & (y <= 1.0 + 1e-12))
    assert np.abs(np.diff(speed)).max() < 0.06
    assert np.abs(np.diff(bend)).max() < 3.0  # a jump of curvature would be 10 and more


def test_travel_and_ease_arrive() -> None:
    for curve in (curves.minimum_jerk, curves.smooth_trapezoid):
        np.testing.assert_allclose(curve(np.array([-1.0, 0.0, 0.5, 1.0, 2.0])), [0.0, 0.0, 0.5, 1.0, 1.0], atol=1e-12)


def test_pulse_peaks_where_told() -> None:
    x = np.arange(0.0, 1.0, STEP)
    for peak in (0.33, 0.5):
        assert x[np.argmax(curves.pulse(x, peak))] == pytest.approx(peak, abs=2.0 * STEP)
        assert curves.pulse(x, peak).max() == pytest.approx(1.0, abs=1e-4)


def test_a_curve_goes_through_its_keys_and_never_beyond(rng: np.random.Generator) -> None:
    at = np.cumsum(rng.uniform(0.1, 0.5, 12))
    keys = rng.normal(size=12)
    t = np.arange(at[0] - 0.5, at[-1] + 0.5, STEP)
    y = curves.interpolate_keys(t, at, keys)
    np.testing.assert_allclose(curves.interpolate_keys(at, at, keys), keys, atol=1e-12)
    for k in range(11):
        inside = y[(t >= at[k]) & (t <= at[k + 1])]
        assert inside.min() >= min(keys[k : k + 2]) - 1e-9
        assert inside.max() <= max(keys[k : k + 2]) + 1e-9
    assert np.abs(np.diff(y, 2)).max() / STEP**2 < 20.0 * np.abs(np.diff(keys)).max() / np.diff(at).min() ** 2


def test_quintics_have_the_derivatives_asked_for(rng: np.random.Generator) -> None:
    at = np.array([0.0, 0.7, 1.5])
    value, slope, bend = (rng.normal(0.0, 1.0, 3) for _ in range(3))
    t = 0.7 + STEP * np.arange(-2.0, 3.0)
    y = curves.quintic_spline(t, at, value, slope, bend)
    assert y[2] == pytest.approx(value[1])
    assert (y[3] - y[1]) / (2 * STEP) == pytest.approx(slope[1], abs=1e-3)
    assert (y[3] - 2 * y[2] + y[1]) / STEP**2 == pytest.approx(bend[1], abs=0.2)


def test_wander_has_the_size_it_says(rng: np.random.Generator) -> None:
    t = np.arange(0.0, 400.0, 0.02)
    sizes = [curves.smooth_noise(rng, t, 2.0, 0.1).std() for _ in range(20)]
    np.testing.assert_allclose(sizes, 0.1, rtol=0.1)


def test_smooth_envelopes_bound_both(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, 500))
    low, high = curves.smooth_minimum(a, b, 0.1), curves.smooth_maximum(a, b, 0.1)
    assert np.all((low <= np.minimum(a, b)) & (low >= np.minimum(a, b) - 0.05))
    assert np.all((high >= np.maximum(a, b)) & (high <= np.maximum(a, b) + 0.05))


def test_gestures_add_up_and_rest_outside() -> None:
    t = np.arange(0.0, 4.0, 0.01)
    moments = {"start": 0.0, "hit": 0.4, "end": 1.0}
    keys = keyframes_at(moments, 0.05, hit=2.0)
    assert keys == [(0.0, 0.0), (0.45, 2.0), (1.0, 0.0)]
    both = sum_gestures(t, [Gesture(0.5, {"arm": keys}), Gesture(2.0, {"arm": keys, "leg": keys})])
    assert both["arm"][np.searchsorted(t, 0.9499)] == pytest.approx(2.0, abs=1e-3)
    assert np.all(both["arm"][(t > 1.51) & (t < 1.99)] == 0.0)
    assert both["leg"].max() == pytest.approx(2.0, abs=1e-3)
    assert np.all(both["unheard of"] == 0.0)


def test_euler_angles_are_undone(rng: np.random.Generator) -> None:
    angles = rng.uniform(-1.4, 1.4, (200, 3))
    m = (
        limb_ik.axis_rotation(2, angles[:, 2])
        @ limb_ik.axis_rotation(1, angles[:, 1])
        @ limb_ik.axis_rotation(0, angles[:, 0])
    )
    np.testing.assert_allclose(limb_ik.euler_xyz(m), angles, atol=1e-9)


def test_the_middle_joint_is_one_bone_from_either_end(rng: np.random.Generator) -> None:
    top, towards = rng.normal(size=(2, 100, 3))
    end = top + limb_ik.normalize(rng.normal(size=(100, 3))) * rng.uniform(0.2, 0.75, (100, 1))
    knee = limb_ik.middle_joint(top, end, towards, 0.41, 0.38)
    np.testing.assert_allclose(np.linalg.norm(knee - top, axis=1), 0.41, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(end - knee, axis=1), 0.38, atol=1e-9)
    foot_of_knee = top + limb_ik.normalize(end - top) * np.sum(
        (knee - top) * limb_ik.normalize(end - top), axis=1, keepdims=True
    )
    assert np.all(np.sum((knee - foot_of_knee) * towards, axis=1) > 0.0)


def test_pointing_reaches_its_direction(rng: np.random.Generator) -> None:
    vector = np.array([0.001, -0.03, 0.118])
    a, c = rng.uniform(-0.6, 0.6, (2, 50))
    wanted = limb_ik.rotate_vectors(
        limb_ik.axis_rotation(1, c) @ limb_ik.axis_rotation(0, a), limb_ik.normalize(vector)
    )
    found_a, found_c = limb_ik.universal_joint_angles(vector, wanted)
    np.testing.assert_allclose(found_a, a, atol=1e-9)
    np.testing.assert_allclose(found_c, c, atol=1e-9)


def test_a_planted_ball_stays_and_the_foot_arrives() -> None:
    t = np.arange(0.0, 3.0, 0.005)
    skeleton = synthetic.performer_skeleton("p1")
    plants = [
        FootContact(0.0, 1.0, (0.0, 0.0), 0.0, 0.3, 0.9, 0.05, 0.33),
        FootContact(1.5, 3.0, (0.8, 0.1), 0.4, 0.3, 0.9),
    ]
    moving = plan_foot(t, skeleton, "l", plants)
    still = (t > 0.3) & (t <= 1.0)
    np.testing.assert_allclose(moving.toe_m[still], np.tile([0.0, 0.0, BALL_M], (still.sum(), 1)), atol=1e-12)
    assert moving.toe_m[(t > 1.0) & (t < 1.5), 2].max() > BALL_M + 0.03
    late = (t > 1.8) & (t < 2.2)
    np.testing.assert_allclose(moving.toe_m[late], np.tile([0.8, 0.1, BALL_M], (late.sum(), 1)), atol=1e-9)
    assert moving.direction[late, 2] == pytest.approx(-np.sin(flat_pitch_rad(skeleton, "l")))
