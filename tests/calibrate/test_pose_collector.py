"""Collection of held poses from streams: all of them in order, whatever the performer does in between."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from harness.body import DEFAULT_MOUNTS, Body, build_body, retarget_to_own_body
from harness.calibrate.guided_calibration import PoseGuide
from harness.calibrate.hold import UnusableHold, measure_hold
from harness.calibrate.pose_classifier import PoseClassifier
from harness.calibrate.pose_collector import HOLD_S, PoseCollector
from harness.calibrate.poses import POSES, pose_configuration
from harness.core.arrays import Floats
from harness.core.humanoid24 import pack, unpack
from harness.core.seeds import generator
from harness.mocap import synthetic
from harness.simulate import TrackerConfig, hold_poses, hold_times_s, noise_preset, simulate_tracker
from harness.stream import TrackerFrame
from tests.calibrate.test_tpose_calibration import changed

SIX = ("left_wrist", "right_wrist", "left_ankle", "right_ankle", "torso", "head")
FOUR = ("left_hand", "right_hand", "left_ankle", "right_ankle")
RATE_HZ = 25.0


@cache
def body() -> Body:
    return build_body()


def pose(number: int) -> Floats:
    return pose_configuration(POSES[number], body().skeleton)


def arms_down() -> Floats:
    """Configuration of a performer who rests."""
    root_m, turn, angles_rad = unpack(pose(0)[None])
    names = body().skeleton.dof_names
    angles_rad[0, names.index("lhumerus.rz")] += np.deg2rad(75.0)
    angles_rad[0, names.index("rhumerus.rz")] -= np.deg2rad(75.0)
    return pack(root_m[0], turn[0], angles_rad[0])


def stream(
    configurations: Sequence[Floats],
    stations: Sequence[str] = SIX,
    noise: str = "default",
    miss_deg: float = 2.5,
    seed: int = 1,
    who: Body | None = None,
) -> list[TrackerFrame]:
    whose = who or body()
    rng = generator(seed, "held")
    take = hold_poses(whose, configurations, miss_rad=float(np.deg2rad(miss_deg)), rng=rng, rate_hz=50.0)
    mounts = [DEFAULT_MOUNTS[name] for name in stations]
    return list(
        simulate_tracker(whose, take, mounts, TrackerConfig(rate_hz=RATE_HZ), noise_preset(noise), seed=seed).frames
    )


@cache
def eight(noise: str = "default") -> tuple[TrackerFrame, ...]:
    return tuple(stream([pose(n) for n in range(8)], noise=noise))


@cache
def classifier(stations: tuple[str, ...] = SIX) -> PoseClassifier:
    return PoseClassifier(body(), [DEFAULT_MOUNTS[name] for name in stations], [pose(n) for n in range(8)])


def collected(
    frames: Sequence[TrackerFrame], stations: tuple[str, ...] = SIX, *, blind: bool = False
) -> tuple[PoseCollector, list[int]]:
    """The collector after all frames, and its messages with their times."""
    collector = PoseCollector(stations, 8, None if blind else classifier(stations))
    said = [collector.add(frame) for frame in frames]
    return collector, [number for number in said if number is not None]


@pytest.mark.parametrize(("noise", "blind"), [("clean", False), ("default", True)])
def test_all_are_found_when_they_are_held(noise: str, blind: bool) -> None:
    collector, said = collected(eight(noise), blind=blind)
    assert said == list(range(1, 9))
    assert collector.done
    assert not collector.rejected
    first_s = eight(noise)[0].received_s
    for held, began_s, (from_s, to_s) in zip(collector.holds, collector.began_s, hold_times_s(8), strict=True):
        assert from_s - 0.3 < began_s < from_s + 0.6  # before it, the last bit of a movement is slow
        assert held[-1].received_s - first_s < to_s + 0.1
        still = measure_hold(held, SIX)  # which is what it is for
        if noise == "clean":
            off_m = np.linalg.norm([frame.position_m - still.position_m for frame in held], axis=2)
            assert off_m[~np.array([frame.suspect for frame in held])].max() < 0.035
            assert np.median(off_m.max(axis=1)) < 1e-4


@pytest.mark.parametrize(("stations", "miss_deg"), [(SIX, 5.0), (FOUR, 2.5), (FOUR, 5.0)])
def test_poor_poses_of_other_people_are_taken(stations: tuple[str, ...], miss_deg: float) -> None:
    """Nothing is known of the performer."""
    clip = synthetic.generate("walking", "p3", 1, seed=1, duration_s=3.0)
    who = retarget_to_own_body(clip)[0]
    poses = [pose_configuration(one, who.skeleton) for one in POSES]
    _, said = collected(stream(poses, stations, miss_deg=miss_deg, seed=3, who=who), stations)
    assert said == list(range(1, 9))


@pytest.mark.parametrize("place", [0, 3, 8])
def test_a_rest_is_no_pose(place: int) -> None:
    poses = [pose(n) for n in range(8)]
    frames = stream([*poses[:place], arms_down(), *poses[place:]])
    collector, said = collected(frames)
    assert said == list(range(1, 9))
    (passed,) = collector.rejected
    assert collector.message == (str(passed) if place == 8 else "pose 8 of 8 taken")
    assert passed.began_s == pytest.approx(4.5 * place, abs=0.6)
    stills = [measure_hold(held, SIX) for held in collector.holds]
    assert [classifier().nearest(still, stills[0]) for still in stills] == list(range(8))
    wanted = "all 8 poses were taken before" if place == 8 else f"pose {place + 1} is wanted"
    assert wanted in passed.why


def test_a_repeated_pose_and_one_too_early_are_rejected() -> None:
    order = [0, 1, 2, 1, 4, 3, 4, 5, 6, 7]
    collector, said = collected(stream([pose(n) for n in order]))
    assert said == list(range(1, 9))
    assert [passed.why for passed in collector.rejected] == [
        "that looks like pose 2, and pose 4 is wanted",
        "that looks like pose 5, and pose 4 is wanted",
    ]


@pytest.mark.parametrize("count", [7, 9])
def test_another_number_of_holds(count: int) -> None:
    poses = [pose(n % 8) for n in range(count)]
    collector, _ = collected(stream(poses), blind=True)
    assert collector.done == (count == 9)
    assert len(collector.rejected) == count - len(collector.holds)
    if count == 9:
        assert collector.rejected[0].began_s == pytest.approx(36.0, abs=0.6)
        assert str(collector.rejected[0]).endswith("s on not taken: all 8 poses were taken before")


def test_a_stream_that_ends_early_reports_the_poses_so_far() -> None:
    frames = eight()[: round(12.0 * RATE_HZ)]
    told: list[str] = []
    leading = PoseGuide(PoseCollector(SIX, 8, classifier()), POSES)
    with pytest.raises(Exception, match="3 of 8 poses were held") as caught:
        leading.run(frames, told.append)
    assert repr(POSES[3].name) in str(caught.value)
    assert next(line for line in told if "taken" in line) == "pose 1 of 8 taken, held from 0.3 s on"
    assert POSES[0].instruction in told[0]


def test_whoever_walks_holds_nothing() -> None:
    who, take = retarget_to_own_body(synthetic.generate("walking", "p1", 1, seed=1, duration_s=8.0, rate_hz=60.0))
    mounts = [DEFAULT_MOUNTS[name] for name in SIX]
    frames = simulate_tracker(who, take, mounts, TrackerConfig(rate_hz=RATE_HZ), noise_preset("default"), seed=1).frames
    collector, said = collected(frames, blind=True)
    assert not said
    assert not collector.rejected
    assert collector.message.startswith("hold still: ")


def between(frames: Sequence[TrackerFrame], from_s: float, to_s: float) -> list[int]:
    """Indices of the frames within a time range since the first."""
    return [n for n, f in enumerate(frames) if from_s <= f.received_s - frames[0].received_s < to_s]


SILENT = {"position_valid": False, "orientation_valid": False, "position_m": np.nan}


def silenced(from_s: float, to_s: float, *stations: int) -> list[TrackerFrame]:
    """The eight poses, in which some stations are silent for some time; pose n is held from 4.5 n s on for 3 s."""
    frames = list(eight())
    lost = between(frames, from_s, to_s)
    for station in stations:
        frames[lost[0] : lost[-1] + 1] = changed(frames[lost[0] : lost[-1] + 1], station, **SILENT)
    return frames


def test_a_station_that_is_not_seen_in_the_first_pose_is_named_and_waited_for() -> None:
    collector, told = PoseCollector(SIX, 8, classifier()), set()
    for frame in silenced(0.0, 3.0, 2):
        collector.add(frame)
        told.add(collector.message)
    assert not collector.holds
    assert "pose 2, and pose 1 is wanted" in collector.rejected[0].why
    assert any("'left_ankle' was silent or lost" in line for line in told)


@pytest.mark.parametrize("stations", [(4,), (0, 4, 5)])
def test_a_pose_that_some_stations_are_not_heard_in_is_left_out(stations: tuple[int, ...]) -> None:
    said: list[str] = []
    collector = PoseCollector(SIX, 8, classifier())
    PoseGuide(collector, POSES).run(silenced(9.0, 12.2, *stations), said.append)
    assert [len(hold) > 0 for hold in collector.holds] == [number != 2 for number in range(8)]
    assert len(collector.began_s) == 7
    names = ", ".join(SIX[station] for station in stations)
    assert f"pose 3 of 8 left out: {names} silent or lost" in said
    assert [line for line in said if line.startswith("pose 2 of 8 taken")]


def test_a_pose_is_not_left_out_when_most_stations_are_silent_or_another_is_held() -> None:
    collector, said = collected(silenced(9.0, 12.2, 0, 1, 2, 3))
    assert said == [1, 2]
    frames = stream([pose(0), pose(1), pose(3), arms_down()])
    lost = between(frames, 9.0, 18.0)
    frames[lost[0] :] = changed(frames[lost[0] :], 4, **SILENT)
    collector, said = collected(frames)
    assert said == [1, 2]
    assert "'torso' was silent or lost" in collector.message


def test_a_collector_that_knows_no_poses_leaves_none_out() -> None:
    _, said = collected(silenced(9.0, 12.2, 4), blind=True)
    assert said == list(range(1, 8))


def test_three_poses_are_left_out_at_most() -> None:
    collector, said = collected(silenced(4.4, 40.0, 4))
    assert said == [1, 2, 3, 4]
    assert collector.holds.count([]) == 3


def test_a_silent_station_empties_the_meter() -> None:
    """The meter of a still performer fills until the hold is taken; with a silent station it is empty."""
    one = eight("clean")[0]
    still = [replace(one, received_s=0.07 * number) for number in range(60)]
    silent = changed(still, 0, position_valid=False, orientation_valid=False)
    told, meter = {}, {}
    for name, later in (("all", still), ("silent", silent)):
        collector = PoseCollector(SIX, 8)
        assert collector.still_s() == 0.0
        for frame in (*still[:8], *later[8:39]):
            collector.add(frame)
        assert not collector.holds
        meter[name] = collector.still_s()
        collector.add(later[39])
        told[name] = collector.message
        meter[f"{name}, later"] = collector.still_s()
    assert meter == {"all": pytest.approx(0.07 * 38), "all, later": 0.0, "silent": 0.0, "silent, later": 0.0}
    assert told["all"] == "pose 1 of 8 taken"
    assert "'left_wrist' was silent or lost" in told["silent"]


def test_the_meter_is_full_while_a_hold_is_refused() -> None:
    """A station that came back has too few readings, and the meter never exceeds a hold."""
    one = eight("clean")[0]
    still = [replace(one, received_s=0.07 * number) for number in range(40)]
    silent = changed(still, 0, position_valid=False, orientation_valid=False)
    collector = PoseCollector(SIX, 8)
    for frame in (*silent[:30], *still[30:]):
        collector.add(frame)
    assert not collector.holds
    assert collector.still_s() == HOLD_S
    assert "'left_wrist' was silent or lost" in collector.message


def test_the_meter_is_computed_for_displays_only(monkeypatch: pytest.MonkeyPatch) -> None:
    def unread(collector: PoseCollector) -> float:
        raise AssertionError("nobody reads the meter")

    monkeypatch.setattr(PoseCollector, "still_s", unread)
    leading = PoseGuide(PoseCollector(SIX, 8), POSES)
    with pytest.raises(UnusableHold, match="1 of 8 poses were held"):
        leading.run(eight()[: round(4.5 * RATE_HZ)], lambda text: None)


def test_short_losses_and_echoes_are_no_matter(rng: np.random.Generator) -> None:
    frames = list(eight())
    for number in rng.choice(len(frames), len(frames) // 5, replace=False).tolist():
        values = {"position_valid": False} if number % 2 else {"position_m": [7.0, 0.0, 0.0]}
        frames[number] = changed([frames[number]], int(rng.integers(6)), **values)[0]
    _, said = collected(frames)
    assert said == list(range(1, 9))


def test_nothing_is_held_across_a_gap() -> None:
    """After a gap the search for a hold starts anew."""
    frames = [frame for frame in eight() if frame.received_s < 2.0]
    later = [replace(frame, received_s=frame.received_s + 60.0) for frame in frames]
    collector, said = collected([*frames, *later])
    assert not said
    assert not collector.holds
