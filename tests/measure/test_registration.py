"""Registration of captures with known errors."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.body import build_body, retarget_to_own_body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import pack
from harness.core.motion import BodyMotion
from harness.core.number_format import Interval
from harness.core.seeds import generator
from harness.errors import BadInput
from harness.measure.pose_registration import register_poses
from harness.measure.pose_series import MeasuredPoses, TruthPoses
from harness.measure.registration import MountFit, Registration
from harness.mocap import MotionLibrary, synthetic
from harness.simulate import noise_preset
from tests.measure.boxing_captures import BoxingCapture, capture_boxing
from tests.measure.moving_bodies import Tracker, draw_mounts, move_bodies, report_poses

NAMES = ("hand", "head", "foot")
NOISY = Tracker(
    scale=1e-3, heading_rad=0.0, ahead_s=0.002, offset_s=7.0, ratio=20e-6,
    white=(0.00075, 0.0009), drift=(0.0015, 0.006),
)  # fmt: skip
Mounts = dict[str, tuple[Floats, Floats]]


def make_capture(
    rng: np.random.Generator, tracker: Tracker, seconds: float = 60.0
) -> tuple[dict[str, MeasuredPoses], dict[str, TruthPoses], Mounts]:
    truths, mounts = move_bodies(rng, NAMES, seconds), draw_mounts(rng, NAMES)
    return report_poses(rng, truths, mounts, tracker), truths, mounts


def list_errors(
    found: Registration, tracker: Tracker, mounts: Mounts, middle_s: float = 30.0
) -> list[tuple[str, Interval, float]]:
    """Key, measured and true value of everything; at `middle_s` the clocks are the tracker's offset apart [s]."""
    values = found.values
    offset_s = tracker.offset_s + tracker.ratio * (found.reference_s - middle_s)
    out = [
        ("time_offset_orientation_s", values["time_offset_orientation_s"], offset_s),
        ("time_offset_position_s", values["time_offset_position_s"], offset_s - tracker.ahead_s),
        ("position_ahead_s", values["position_ahead_s"], tracker.ahead_s),
        ("clock_ratio_ppm", values["clock_ratio_ppm"], 1e6 * tracker.ratio),
        ("scale", values["scale"], tracker.scale),
        ("heading_rad", values["heading_rad"], tracker.heading_rad),
        *(("tracker_origin_m", values[f"tracker_origin_m.{a}"], float(tracker.origin_m[a])) for a in range(3)),
        *(("room", one, 0.0) for one in _room_turns(found, tracker)),
    ]
    for name, (mount_m, mount) in mounts.items():
        out += [(f"{name} position", found.mounts[name].position(a), float(mount_m[a])) for a in range(3)]
        out += [(f"{name} turn", one, 0.0) for one in found.mounts[name].turn_from(mount)]
    return out


def _room_turns(found: Registration, tracker: Tracker) -> list[Interval]:
    """Rotation vector from the room of the tracker to the measured one, in the tracker's axes."""
    measured = rotations.multiply(rotations.inverse(found.world_from_tracker), rotations.inverse(tracker.room))
    deviation = np.sqrt(np.diag(found.room_covariance[:3, :3]))
    turns = zip(rotations.log(measured).tolist(), deviation.tolist(), strict=True)
    return [Interval.normal(value, one, found.blocks) for value, one in turns]


def test_exact_readings_give_exact_values(rng: np.random.Generator) -> None:
    tracker = replace(NOISY, white=(0.0, 0.0), drift=(0.0, 0.0), heading_rad=0.05, scale=0.01)
    stations, truths, mounts = make_capture(rng, tracker, 20.0)
    found = register_poses(stations, truths)
    for key, measured, true in list_errors(found, tracker, mounts, 10.0):
        assert measured.value == pytest.approx(true, abs=1e-3 if "ppm" in key else 1e-7), key
    assert found.matched > 0.99
    assert found.overlap_s == pytest.approx(20.0, abs=0.2)
    assert found.reference_s == pytest.approx(10.0, abs=0.1)
    assert found.correlation > 0.99
    for errors in found.errors.values():
        np.testing.assert_allclose(errors.position_m, 0.0, atol=1e-7)
        assert errors.truth_s[errors.valid].min() > 0.0


def test_noise_echoes_excursions_and_gaps_are_withstood(rng: np.random.Generator) -> None:
    stations, truths, mounts = make_capture(rng, NOISY)
    disturbed = {}
    for name, one in stations.items():
        place, valid = one.position_m.copy(), one.valid.copy()
        for begin in rng.integers(0, 2300, 16):  # echoes
            place[begin : begin + 4] += 0.1 * rng.normal(size=3)
        for begin in rng.integers(0, 2200, 2):  # excursions
            place[begin : begin + 80] += np.array([0.0, 0.02, 0.0])
        valid[500:520] = False
        disturbed[name] = MeasuredPoses(one.measured_s, place, one.tracker_from_station, valid)
    found = register_poses(disturbed, truths)
    limits = {"_s": 5e-5, "ppm": 2.0, "scale": 1e-3, "heading_rad": 5e-3}
    for key, measured, true in list_errors(found, NOISY, mounts):
        limit = next((size for end, size in limits.items() if key.endswith(end)), 2e-3 if "turn" not in key else 8e-3)
        assert abs(measured.value - true) < limit, key
    for errors in found.errors.values():
        large = np.linalg.norm(errors.position_m, axis=1) > 0.05
        assert large.sum() > 20
        assert not errors.used[large, 0].any()
        assert not errors.used[~errors.valid].any()


@pytest.mark.parametrize(
    ("key", "tracker"),
    [
        ("heading_rad", replace(NOISY, heading_rad=float(np.deg2rad(5.0)))),
        ("scale", replace(NOISY, scale=0.003)),
        ("time_offset_orientation_s", replace(NOISY, offset_s=0.02)),
        ("time_offset_position_s", replace(NOISY, offset_s=0.02, ahead_s=-0.005)),
        ("clock_ratio_ppm", replace(NOISY, ratio=80e-6)),
    ],
)
def test_a_fault_is_measured_with_its_size(key: str, tracker: Tracker, rng: np.random.Generator) -> None:
    stations, truths, mounts = make_capture(rng, tracker, 30.0)
    found = register_poses(stations, truths)
    true = {name: value for name, _, value in list_errors(found, tracker, mounts, 15.0)}[key]
    measured = found.values[key]
    assert measured.value == pytest.approx(true, rel=0.2)
    assert measured.high - measured.low < 0.5 * abs(true)
    assert not measured.contains(0.0)


def test_a_turned_station_shows_its_angle(rng: np.random.Generator) -> None:
    stations, truths, mounts = make_capture(rng, NOISY)
    turned = rotations.exp(np.deg2rad([0.0, 3.0, 0.0]))
    found = register_poses(stations, truths).mounts
    angle = found["hand"].angle_from(rotations.multiply(turned, mounts["hand"][1]))
    assert angle.value == pytest.approx(np.deg2rad(3.0), rel=0.15)
    assert angle.low > np.deg2rad(2.0)
    assert found["head"].angle_from(mounts["head"][1]).low == 0.0
    assert found["head"].distance_from(mounts["head"][0]).low == 0.0
    assert found["hand"].distance_from(mounts["hand"][0] + 0.05).value == pytest.approx(0.05 * 3**0.5, rel=0.05)


def test_length_has_the_interval_of_three_errors() -> None:
    mount = MountFit("hand", "hand", np.array([0.0, 0.0, 1.0]), rotations.IDENTITY, 1e-4 * np.eye(6), 12)
    found = mount.distance_from(np.zeros(3))
    assert (found.value, found.low) == pytest.approx((1.0, 1.0 - 0.01 * 2.7955), rel=1e-4)


def test_a_point_in_the_room_has_the_error_of_the_rotation(rng: np.random.Generator) -> None:
    """The covariance of a point is that of points under drawn rooms."""
    stations, truths, _ = make_capture(rng, NOISY, 20.0)
    found = register_poses(stations, truths)
    point_m = np.array([0.3, -0.4, 1.5])
    draws = rng.multivariate_normal(np.zeros(6), found.room_covariance, 20_000, check_valid="ignore")
    room = rotations.multiply(rotations.exp(draws[:, :3]), found.state.tracker_from_world)
    points = found.tracker_origin_m + draws[:, 3:] + rotations.rotate(rotations.inverse(room), point_m)
    for axis, measured in enumerate(found.room_point(point_m)):
        assert measured.value == pytest.approx(points[:, axis].mean(), abs=1e-4)
        assert (measured.high - measured.low) / 3.92 == pytest.approx(points[:, axis].std(), rel=0.05)


def test_stations_on_bodies_of_other_names(rng: np.random.Generator) -> None:
    stations, truths, mounts = make_capture(rng, replace(NOISY, drift=(0.0, 0.0)), 20.0)
    found = register_poses({"left": stations["hand"]}, truths, pairs={"left": "hand"})
    assert rotations.angle_between_rad(found.mounts["left"].body_from_station, mounts["hand"][1]) < 5e-3
    with pytest.raises(BadInput, match="not the reference's, or stations are on other bodies"):
        register_poses({"left": stations["hand"]}, truths, pairs={"left": "head"})


def test_inputs_that_do_not_show_the_values_are_refused(rng: np.random.Generator) -> None:
    stations, truths, mounts = make_capture(rng, NOISY, 20.0)
    hand, truth = stations["hand"], truths["hand"]

    def refuses(changed: MeasuredPoses, reference: TruthPoses, message: str) -> None:
        with pytest.raises(BadInput, match=message):
            register_poses({"hand": changed}, {"hand": reference})

    unstamped = MeasuredPoses(np.full(len(hand.valid), np.nan), hand.position_m, hand.tracker_from_station, hand.valid)
    refuses(unstamped, truth, "'hand' have no time stamps")
    alone = MeasuredPoses(hand.measured_s[:1], hand.position_m[:1], hand.tracker_from_station[:1], hand.valid[:1])
    refuses(alone, truth, "'hand' has one pose")
    sparse = MeasuredPoses(
        hand.measured_s, hand.position_m, hand.tracker_from_station, np.arange(len(hand.valid)) % 12 != 0
    )
    refuses(sparse, truth, r"91\.\d % of the records due")
    rows = slice(0, 600)
    short = TruthPoses(truth.time_s[rows], truth.position_m[rows], truth.world_from_body[rows])
    refuses(hand, short, "overlap by at most")
    hole = np.array(truth.position_m)
    hole[600:1000] = np.nan
    refuses(hand, TruthPoses(truth.time_s, hole, truth.world_from_body), "of the records due in the overlap")
    hinge = move_bodies(rng, ("hand",), 20.0, turns=(0.8, 0.0, 0.0))
    refuses(report_poses(rng, hinge, {"hand": mounts["hand"]}, NOISY)["hand"], hinge["hand"], "about one axis only")


def test_a_body_that_stays_in_place_does_not_show_the_heading(rng: np.random.Generator) -> None:
    truth = move_bodies(rng, ("hand",), 20.0)["hand"]
    still = {"hand": TruthPoses(truth.time_s, np.zeros((len(truth.time_s), 3)), truth.world_from_body)}
    stations = report_poses(rng, still, {"hand": (np.zeros(3), rotations.IDENTITY)}, NOISY)
    with pytest.raises(BadInput, match="Not observable from this motion"):
        register_poses(stations, still)


@pytest.mark.slow
def test_intervals_contain_the_truth() -> None:
    """Values of each kind lie in their intervals in 90 to 99 % of 200 captures, each 30 s long."""
    covered: dict[str, list[bool]] = {}
    for seed in range(200):
        stations, truths, mounts = make_capture(generator(seed, "registration"), NOISY, 30.0)
        found = register_poses(stations, truths)
        for key, measured, true in list_errors(found, NOISY, mounts, 15.0):
            covered.setdefault(key, []).append(measured.contains(true))
    shares = {key: float(np.mean(values)) for key, values in covered.items()}
    print(shares)
    assert all(0.9 <= share <= 0.99 for share in shares.values()), shares


def check_figures(captures: list[BoxingCapture]) -> None:
    """The figures of a minute of boxing: each capture, and the median rotation."""
    angles = []
    for capture in captures:
        found = register_poses(capture.stations, capture.truths, pairs=capture.body_of)
        values = found.values
        late_s = 20e-6 * found.reference_s
        assert values["time_offset_orientation_s"].value == pytest.approx(late_s, abs=0.5e-3)
        assert values["position_ahead_s"].value == pytest.approx(0.002, abs=0.6e-3)
        assert values["clock_ratio_ppm"].value == pytest.approx(20.0, abs=10.0)
        assert values["scale"].value == pytest.approx(capture.scale, abs=1e-3)
        assert values["heading_rad"].value == pytest.approx(0.0, abs=np.deg2rad(0.5))
        assert np.linalg.norm(found.tracker_origin_m - capture.tracker_origin_m) < 0.002
        angles.append(rotations.angle_between_rad(found.world_from_tracker, capture.world_from_tracker))
        for station, (mount_m, mount) in capture.mounts.items():
            measured = found.mounts[station]
            assert np.linalg.norm(measured.position_m - mount_m) < 0.002, station
            angles.append(rotations.angle_between_rad(measured.body_from_station, mount))
    print("largest and median angle", np.rad2deg([np.max(angles), np.median(angles)]))
    assert np.max(angles) < np.deg2rad(0.5)
    assert np.median(angles) < np.deg2rad(0.3)


@pytest.mark.long
def test_a_minute_of_synthetic_boxing_meets_the_figures() -> None:
    captures = []
    for performer in ("p1", "p2"):
        clip = synthetic.generate("boxing", performer, 1, seed=3, duration_s=60.0, rate_hz=120.0)
        qpos = pack(clip.root_m, clip.world_from_root, clip.angles_rad)
        take = BodyMotion(clip.name, clip.subject, clip.source, clip.behaviour, 120.0, qpos)
        captures += [capture_boxing(build_body(), take, noise_preset("default"), seed) for seed in (1,)]
    check_figures(captures)


@pytest.mark.long
def test_real_boxing_meets_the_figures(mocap: Path) -> None:
    clips = [MotionLibrary(mocap).load(name) for name in ("13_17", "14_02")]
    moved = [(name, *retarget_to_own_body(clip)) for name, clip in zip(("13_17", "14_02"), clips, strict=True)]
    print({name: len(take) / take.rate_hz for name, _, take in moved})
    check_figures([capture_boxing(body, take, noise_preset("default"), 1) for _, body, take in moved])
