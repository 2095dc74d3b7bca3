"""The set-ups of the papers, and impossible configurations."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from harness.body import Body, Kinematics, Mount
from harness.core import rotations
from harness.core.motion import BodyMotion
from harness.errors import BadInput, UnknownName
from harness.simulate.components.faults import LostStation
from harness.simulate.components.mount import MountOffset, MountSlip
from harness.simulate.components.stationary import Clock, DriftNoise, SessionBias, SpeedError, WhiteNoise
from harness.simulate.components.transient import Dropout, Echo, Excursion
from harness.simulate.link import TrackerConfig
from harness.simulate.noise import Noise, noise_preset
from harness.simulate.simulation import Simulation, simulate_tracker
from tests.simulate.conftest import SIX, worn

Boxer = tuple[Body, BodyMotion]
HANDS = ("left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head")
FEET = ("left_wrist", "right_wrist", "left_foot", "right_foot", "torso", "head")
FIVE = ("left_wrist", "right_wrist", "left_ankle", "right_ankle", "pelvis")


def error_m(body: Body, simulation: Simulation) -> float:
    """Largest distance of a decoded station, in world axes, from MuJoCo's at the frame's time."""
    known, kinematics, worst = simulation.calibration, Kinematics(body), 0.0
    bones = [body.skeleton.index(bone) for bone in known.bones]
    for frame, index in zip(simulation.frames, simulation.frame_index, strict=True):
        kinematics.set(simulation.truth_qpos[index])
        at_m, _ = kinematics.station_poses(bones, known.mount_m, known.bone_from_station)
        told_m = known.tracker_origin_m + rotations.rotate(known.world_from_tracker, frame.position_m)
        worst = max(worst, float(np.abs(told_m - at_m).max()))
    return worst


@pytest.mark.parametrize("stations", [SIX, HANDS, FEET, FIVE, ("head",)], ids=["six", "hands", "feet", "five", "one"])
def test_every_set_up_gives_whole_frames(boxer: Boxer, stations: tuple[str, ...]) -> None:
    """Read all at once (no skew), decoded stations are where MuJoCo has them at the frame's time."""
    simulation = simulate_tracker(*boxer, worn(*stations), TrackerConfig(slot_s=0.0), noise_preset("clean"), seed=1)
    assert simulation.stations == simulation.calibration.stations == stations
    assert len(simulation.frames) == simulation.expected == 481
    assert all(frame.position_m.shape == (len(stations), 3) for frame in simulation.frames)
    assert error_m(boxer[0], simulation) < 1e-6


def test_ankle_trackers_sit_on_the_shin_and_may_sit_on_the_foot(boxer: Boxer) -> None:
    bones = {
        station: bone
        for stations in (SIX, FEET)
        for known in [simulate_tracker(*boxer, worn(*stations), TrackerConfig(), Noise(), seed=1).calibration]
        for station, bone in zip(known.stations, known.bones, strict=True)
    }
    assert (bones["left_ankle"], bones["right_ankle"]) == ("ltibia", "rtibia")
    assert (bones["left_foot"], bones["right_foot"]) == ("lfoot", "rfoot")


def test_readings_in_the_health_add_up(boxer: Boxer) -> None:
    tracker = TrackerConfig(rate_hz=60.0)
    simulation = simulate_tracker(*boxer, worn(), tracker, noise_preset("default"), seed=1)
    health, frames = simulation.health, simulation.frames
    assert health["frames_sampled"] == simulation.expected
    assert health["frames_received"] == len(frames)
    assert health["records_sent"] + health["records_dropped"] == 6 * simulation.expected
    assert health["readings_invalid"] == sum(int((~frame.position_valid).sum()) for frame in frames)
    assert health["readings_suspect"] == sum(int(frame.suspect.sum()) for frame in frames) == 0


REFUSED: dict[str, Callable[[], object]] = {
    "negative share": lambda: Echo(share=-0.1),
    "all echo": lambda: Echo(share=1.0),
    "no number": lambda: WhiteNoise(position_m=float("nan")),
    "bursts of nothing": lambda: Echo(burst_records=(0, 0)),
    "descending": lambda: Excursion(stay_s=(5.0, 1.0)),
    "ten million excursions at once": lambda: Excursion(onsets_per_min=600.0, stay_s=(1e6, 1e6)),
    "a thousand gaps a second": lambda: Dropout(share=0.99, gap_s=(0.001, 0.001)),
    "negative size": lambda: Echo(size_m=(-0.1, 0.3)),
    "negative rate": lambda: Excursion(onsets_per_min=-1.0),
    "negative ramp": lambda: Excursion(ramp_s=-0.1),
    "all lost": lambda: Dropout(share=1.0),
    "gaps of nothing": lambda: Dropout(gap_s=(0.0, 0.5)),
    "no memory": lambda: DriftNoise(correlation_s=0.0),
    "negative noise": lambda: WhiteNoise(orientation_rad=-0.01),
    "scale": lambda: SessionBias(scale=2.0),
    "speed": lambda: SpeedError(ahead_s=float("inf")),
    "clock before zero": lambda: Clock(offset_s=-1.0),
    "clock backwards": lambda: Clock(drift_ppm=-2e6),
    "ends before it begins": lambda: LostStation("head", 3.0, 1.0),
    "mount": lambda: MountOffset(position_m=-0.01),
    "slip": lambda: MountSlip("head", over_s=-1.0),
}


@pytest.mark.parametrize("make", REFUSED.values(), ids=REFUSED)
def test_parameters_that_cannot_be_are_refused_in_words(make: Callable[[], object]) -> None:
    with pytest.raises(BadInput, match=r"= .*\. Give (a number|two ascending numbers) ") as caught:
        make()
    assert len(str(caught.value)) < 120


def test_the_message_names_component_field_and_range() -> None:
    with pytest.raises(BadInput) as caught:
        Dropout(gap_s=(0.5, 0.1))
    assert str(caught.value) == "Dropout.gap_s = (0.5, 0.1). Give two ascending numbers from 0.001 to 1e+06."


def test_stations_have_names_of_their_own(boxer: Boxer) -> None:
    with pytest.raises(BadInput, match="a name occurs twice"):
        simulate_tracker(*boxer, worn("head", "head"), TrackerConfig(), Noise(), seed=1)
    with pytest.raises(BadInput, match="1 to 12"):
        simulate_tracker(*boxer, [], TrackerConfig(), Noise(), seed=1)
    thirteen = [Mount(f"s{k}", "head", 1.0) for k in range(13)]
    with pytest.raises(BadInput, match="1 to 12"):
        simulate_tracker(*boxer, thirteen, TrackerConfig(), Noise(), seed=1)


@pytest.mark.parametrize(
    ("key", "value"),
    [("rate_hz", float("inf")), ("rate_hz", float("nan")), ("rate_hz", 0.0), ("latency_s", -5.0), ("baud", 0),
     ("queue_records", 0)],
)  # fmt: skip
def test_an_impossible_tracker_is_refused_with_its_key(key: str, value: Any) -> None:
    with pytest.raises(BadInput, match=f"^TrackerConfig.{key} = {value}. Give a number"):
        TrackerConfig(**{key: value})


@pytest.mark.parametrize("noise", [Noise(lost=(LostStation("haed"),)), Noise(mount_slip=(MountSlip("haed"),))])
def test_faults_of_stations_that_are_not_worn_are_refused(boxer: Boxer, noise: Noise) -> None:
    with pytest.raises(UnknownName, match="Did you mean 'head'"):
        simulate_tracker(*boxer, worn(), TrackerConfig(), noise, seed=1)
