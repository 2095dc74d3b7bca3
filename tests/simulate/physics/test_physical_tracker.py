"""The driver of the parts: blocks of any size, and the counts for the stream's health."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.simulate.components.soft_tissue import skin_below
from harness.simulate.noise import Noise
from harness.simulate.physical_readings import place_constellation
from harness.simulate.physics.constellation import ConstellationSettings, load_constellation
from harness.simulate.physics.filter_settings import Fusion
from harness.simulate.physics.free_motion import FACING_UP, FreeMotionSource
from harness.simulate.physics.line_of_sight import LineOfSight
from harness.simulate.physics.physical_tracker import PhysicalTracker, lead_in_s, lead_in_slots
from harness.simulate.physics.ranging import Ranges
from harness.simulate.physics.room import PlacedRoom
from harness.simulate.physics.settings import Physics
from harness.simulate.physics.station_displacement import BodyMotionSource, StationDisplacement
from harness.simulate.simulation import WORLD_FROM_TRACKER, exact_calibration
from harness.simulate.trajectory import Trajectory
from tests.simulate.conftest import worn
from tests.simulate.physical_takes import TRACKER, observed, performed, physical

PHYSICS = Physics(fusion=Fusion(prediction_ms={"head": 30}, enhancement={"left_wrist": 1, "torso": 2}))


@pytest.mark.parametrize("slots", [1, 7, 53])
def test_bytes_do_not_depend_on_the_size_of_the_blocks(slots: int, monkeypatch: pytest.MonkeyPatch) -> None:
    noise = physical("default", PHYSICS)
    whole = observed(noise)
    monkeypatch.setattr(PhysicalTracker, "block_slots", slots)
    pieces = observed(noise)
    assert pieces.wire.data == whole.wire.data
    assert pieces.health == whole.health


def test_the_lead_in_is_a_whole_number_of_slots() -> None:
    """A slot is five ticks of the inertial sensors; 0.5 s of 333.3 Hz are 33.33 slots."""
    inertial = replace(Physics().inertial, rate_hz=333.3)
    physics = Physics(inertial=inertial, fusion=Fusion(warm_up_s=0.5))
    assert lead_in_slots(physics) == 34
    assert lead_in_s(physics) == pytest.approx(34 * 5 / 333.3)


def make_tracker(name: str = "cave") -> PhysicalTracker:
    """The chest and left ankle of the boxer, who boxes for 3 s below a constellation."""
    (body, take), mounts = performed(), worn("left_ankle", "torso")
    calibration = exact_calibration(body, mounts, TRACKER)
    physics, trajectory = Physics(ConstellationSettings(name)), Trajectory(body, take)
    constellation, placed = place_constellation(trajectory, calibration, physics)
    whole = trajectory.with_lead_in(lead_in_s(physics)).with_lead_out(0.5)
    skin = skin_below(body.skeleton, mounts, calibration)
    component = StationDisplacement(Noise(), calibration.stations, skin, tick_hz=400.0, ends_s=3.0, seed=1, take="t")
    source = BodyMotionSource(whole, calibration, component)
    return PhysicalTracker(source, physics, constellation, placed, LineOfSight(body, placed), seed=1, take="t")


@pytest.mark.parametrize("name", ["cave", "hall"])
def test_health_counts_what_the_ranges_say(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Counted again by hand: three emitters heard within the last turn, and the share of echoes, from time 0 on."""
    tracker, seen = make_tracker(name), dict[int, tuple[Ranges, int]]()
    measure = tracker.ranging.measure_ranges

    def watched(first: int, *block: object) -> Ranges:
        found = measure(first, *block)  # type: ignore[arg-type]
        seen.update({first + k: (found, k) for k in range(len(found.emitter))})
        return found

    monkeypatch.setattr(tracker.ranging, "measure_ranges", watched)
    time_s = np.repeat(np.arange(0.0, 2.5, 0.025)[:, None], 2, axis=1)
    found = tracker.measure_take(time_s)
    slots = range(int(np.floor(2.475 * 400.0)) // 5 + 1)
    for station in range(2):
        heard = {slot: bool(ranges.direct[k, station].any()) for slot, (ranges, k) in seen.items()}
        enough = [sum(heard.get(slot - back, False) for back in range(9)) >= 3 for slot in slots]
        assert found.coverage_share[station] == pytest.approx(np.mean(enough))
        received = sum(int(np.sum(~np.isnan(seen[slot][0].range_m[seen[slot][1], station]))) for slot in slots)
        echoes = sum(int(np.sum(seen[slot][0].echo[seen[slot][1], station])) for slot in slots)
        assert found.echo_share[station] == pytest.approx(echoes / received)


def test_a_part_of_the_records_has_their_values() -> None:
    """Values are those of the record's time, however many others are asked for."""
    time_s = np.repeat(np.arange(0.0, 2.5, 0.025)[:, None], 2, axis=1)
    whole, some = make_tracker().measure_take(time_s), make_tracker().measure_take(time_s[7::13])
    np.testing.assert_array_equal(some.position_m, whole.position_m[7::13])
    np.testing.assert_array_equal(some.quality, whole.quality[7::13])
    np.testing.assert_array_equal(some.ranges_received, whole.ranges_received[7::13])
    assert whole.ranges_received.max() == 12
    assert (whole.ranges_rejected <= whole.ranges_received).all()


@pytest.mark.parametrize("rate_hz", [120, 200])
def test_readings_at_common_times_do_not_depend_on_the_rate(rate_hz: int) -> None:
    """Steps of 1/120 s and of 1/40 s meet at times whose last bits differ, also at the edges of slots."""
    time_s, step = np.arange(100) * (1.0 / 40.0), rate_hz // 40
    faster_s = np.arange(100 * step) * (1.0 / rate_hz)
    assert np.any(faster_s[::step] != time_s)
    slow, fast = (make_tracker().measure_take(np.repeat(at_s[:, None], 2, axis=1)) for at_s in (time_s, faster_s))
    np.testing.assert_allclose(fast.position_m[::step], slow.position_m, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(fast.ranges_received[::step], slow.ranges_received)


def known_microphones(session: str, take: str = "t", count: int = 200) -> Floats:
    """(S, 2, 3) where the device assumes the microphones of stations at rest, from the station's origin [m]."""
    physics, still = Physics(), np.zeros((2, count, 3))
    turn = np.tile(FACING_UP, (2, count, 1))
    names = [f"station {s}" for s in range(count)]
    source = FreeMotionSource(names, np.array([0.0, 1.0]), still, turn, warm_up_s=lead_in_s(physics))
    placed = PlacedRoom(physics.room, np.zeros(2), WORLD_FROM_TRACKER, np.array(TRACKER.origin_m))
    constellation = load_constellation(physics.constellation)
    tracker = PhysicalTracker(source, physics, constellation, placed, None, seed=1, take=take, session=session)
    out: Floats = tracker.fusion.model.ranging.arm_m + np.array(physics.inertial.lever_m)
    return out


def test_the_device_misplaces_the_microphones_of_each_station_for_a_session() -> None:
    off_m = known_microphones("day") - np.array(Physics().sound.microphones_m)
    assert np.std(off_m, axis=0) == pytest.approx(np.full((2, 3), Physics().sound.microphone_sd_m), rel=0.2)
    assert np.abs(np.mean(off_m, axis=0)).max() < 0.25 * Physics().sound.microphone_sd_m
    assert np.array_equal(known_microphones("day", "another", 3), known_microphones("day", count=3))
    assert np.array_equal(known_microphones("", "day", 3), known_microphones("day", count=3))
    assert not np.isclose(known_microphones("night", count=3), known_microphones("day", count=3)).any()
