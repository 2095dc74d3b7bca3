"""Disturbances: the effect of each on a boxer's readings, and that it has no other."""

import numpy as np
import pytest

from harness.body import Body, retarget_to_own_body
from harness.core import rotations
from harness.core.motion import BodyMotion
from harness.mocap import synthetic
from harness.simulate.disturbance import KINDS, Disturbance, Kind
from harness.simulate.noise import noise_preset
from harness.simulate.simulation import Simulation, TrackerConfig, simulate_tracker
from tests.simulate.conftest import SIX, worn

BEGIN_S, END_S = 3.0, 5.0


@pytest.fixture(scope="module")
def seen(boxer: tuple[Body, BodyMotion]) -> dict[Kind, Simulation]:
    """One take with the same noise under every disturbance, at times away from the edges."""
    found: dict[Kind, Simulation] = {}
    for kind in KINDS:
        noise = Disturbance(kind, station="right_wrist", from_s=BEGIN_S).add_to(noise_preset("default"), SIX)
        found[kind] = simulate_tracker(*boxer, worn(), TrackerConfig(slot_s=0.0), noise, seed=4)
    return found


def differences(seen: dict[Kind, Simulation], kind: Kind) -> tuple[np.ndarray, ...]:
    """Of matched frames: time (F,), shift (F, S, 3), turn (F, S, 3) against the undisturbed run, who is lost (F, S)."""
    plain, other = seen["none"], seen[kind]
    np.testing.assert_array_equal(plain.frame_index, other.frame_index)
    np.testing.assert_array_equal(plain.truth_qpos, other.truth_qpos)
    pairs = list(zip(plain.frames, other.frames, strict=True))
    shift = np.array([b.position_m - a.position_m for a, b in pairs])
    turn = np.array(
        [rotations.multiply(b.tracker_from_station, rotations.inverse(a.tracker_from_station)) for a, b in pairs]
    )
    gone = np.array([a.position_valid & ~b.position_valid for a, b in pairs])
    return plain.truth_s[plain.frame_index], shift, rotations.log(turn), gone


@pytest.mark.parametrize("kind", KINDS)
def test_each_does_what_it_says_where_it_says_and_leaves_every_other_draw_alone(
    seen: dict[Kind, Simulation], kind: Kind
) -> None:
    time_s, shift, turn, gone = differences(seen, kind)
    begin_s = 0.0 if kind == "start_off" else BEGIN_S
    during = (time_s >= begin_s) & (time_s < begin_s + 2.0)
    right_wrist = np.arange(6) == 1
    expected_shift, expected_turn, lost = np.zeros((6, 3)), np.zeros(3), np.zeros(6, bool)
    match kind:
        case "one_lost":
            lost = right_wrist
        case "all_lost":
            lost = ~lost
        case "one_off":
            expected_shift[1] = [0.3, 0.0, 0.0]
        case "start_off":
            expected_shift[:] = [1.0, 0.0, 0.0]
        case "all_turned":
            expected_turn = np.array([0.0, 0.0, np.pi / 6.0])
    usable = np.isfinite(shift[..., 0])
    for where, moved, turned in ((during, expected_shift, expected_turn), (~during, 0.0 * expected_shift, np.zeros(3))):
        both = where[:, None] & usable
        assert both.any() or kind == "all_lost"
        np.testing.assert_allclose(shift[both], np.broadcast_to(moved, shift.shape)[both], atol=1e-4)
        np.testing.assert_allclose(turn[both], np.broadcast_to(turned, turn.shape)[both], atol=1e-4)
    silent_anyway = ~np.array([frame.position_valid for frame in seen["none"].frames])
    np.testing.assert_array_equal(gone, during[:, None] & lost & ~silent_anyway)


def test_it_ends_when_it_says() -> None:
    assert (Disturbance("one_off", from_s=3.0, lasts_s=2.0).begins_s, Disturbance("one_off").ends_s) == (3.0, 5.0)
    assert (Disturbance("start_off").begins_s, Disturbance("start_off").ends_s) == (0.0, 2.0)


@pytest.mark.long
@pytest.mark.parametrize(("behaviour", "rate_hz"), [("boxing", 120.0), ("jumping", 40.0)])
def test_no_sound_reading_of_a_simulation_is_suspect(behaviour: str, rate_hz: float) -> None:
    """With every noise preset and disturbance, and with the 16-bit list too."""
    body, take = retarget_to_own_body(synthetic.generate(behaviour, "p1", 1, seed=1))
    setups: list[tuple[str, Kind]] = [("clean", "none"), ("noise", "none"), *(("default", kind) for kind in KINDS)]
    for preset, kind in setups:
        for items in ((40, 2, 11, 21, 1), (40, 18, 19, 21, 1)) if kind == "none" else ((40, 2, 11, 21, 1),):
            disturbed_noise = Disturbance(kind=kind).add_to(noise_preset(preset), SIX)
            tracker = TrackerConfig(rate_hz=rate_hz, baud=921600, items=items)
            result = simulate_tracker(body, take, worn(), tracker, disturbed_noise, seed=3)
            assert not any(frame.suspect.any() for frame in result.frames), (preset, kind, items)
