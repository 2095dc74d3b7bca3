"""The motion generator has properties of human motion: joint limits, fixed feet, ballistic flight, smoothness."""

import time
from functools import cache
from hashlib import blake2b

import numpy as np
import pytest

from harness.core import humanoid24
from harness.core.arrays import Bools, Floats
from harness.core.motion import Clip
from harness.core.skeleton import Pose, forward_kinematics
from harness.errors import BadInput, UnknownName
from harness.mocap import open_motion_source, synthetic
from harness.mocap.file_inspection import inspect_clip
from harness.mocap.synthetic.curves import GRAVITY_M_S2
from harness.mocap.synthetic.footwork import ANKLE_M, BALL_M, HEEL_BEHIND_M, flat_pitch_rad
from harness.mocap.synthetic.performers import performer_habits
from harness.mocap.synthetic.style import Style

TAKES = [("p1", 1), ("p2", 2), ("p3", 3), ("p4", 4), ("p5", 5), ("p6", 6), ("p21", 3), ("p57", 2)]
"""Six of the performers with a neutral style, two with their own; every take number."""
STYLED = [who for who in synthetic.performer_names() if who not in synthetic.REFERENCE_PERFORMERS]
EVERY = [(behaviour, who, take) for behaviour in synthetic.BEHAVIOURS for who, take in TAKES]
on_every_take = pytest.mark.parametrize(("behaviour", "who", "take"), EVERY)
on_every_behaviour = pytest.mark.parametrize("behaviour", synthetic.BEHAVIOURS)


@cache
def made(behaviour: str, who: str, take: int, seed: int = 7) -> tuple[Clip, Pose]:
    clip = synthetic.generate(behaviour, who, take, seed=seed)
    return clip, forward_kinematics(clip.skeleton, clip.root_m, clip.world_from_root, clip.angles_rad)


def speed_m_s(points: Floats, rate_hz: float) -> Floats:
    """(T-1,) speed of points (T, 3) [m/s]."""
    out: Floats = np.linalg.norm(np.diff(points, axis=0), axis=-1) * rate_hz
    return out


def sole(clip: Clip, pose: Pose, side: str) -> dict[str, Floats]:
    """Heel and ball of a foot (T, 3), with heights relative to those of a flat foot."""
    b = clip.skeleton.index(f"{side}foot")
    ankle, ball = pose.start_m[:, b], pose.end_m[:, b]
    line = (ball - ankle) / clip.skeleton.length_m[b]
    pitch = np.arcsin(-line[:, 2]) - flat_pitch_rad(clip.skeleton, side)
    ahead = line * [1.0, 1.0, 0.0] / np.maximum(np.linalg.norm(line[:, :2], axis=1), 1e-9)[:, None]
    down, back = -np.cos(pitch) * ANKLE_M, -np.cos(pitch) * HEEL_BEHIND_M
    heel = ankle + (back - np.sin(pitch) * ANKLE_M)[:, None] * ahead
    heel[:, 2] = ankle[:, 2] + down + np.sin(pitch) * HEEL_BEHIND_M
    return {"heel": heel, "ball": ball - [0.0, 0.0, BALL_M]}


def airborne(clip: Clip, pose: Pose) -> Bools:
    """(T,) frames in which no sole is within 3 mm of the floor."""
    low = [np.minimum(*(points[:, 2] for points in sole(clip, pose, side).values())) for side in "lr"]
    out: Bools = np.minimum(*low) > 0.003
    return out


def runs(mask: Bools) -> list[tuple[int, int]]:
    """First frame and end of each run of True in `mask` (T,), without runs at the borders."""
    edges = np.flatnonzero(np.diff(mask.astype(int)))
    starts, ends = edges[~mask[edges]] + 1, edges[mask[edges]] + 1
    return [(int(s), int(ends[ends > s][0])) for s in starts if np.any(ends > s)]


@on_every_behaviour
def test_take_names_carry_performer_and_number(behaviour: str) -> None:
    names = synthetic.take_names(behaviour)
    assert len(set(names)) == len(names) >= 12
    for name in names[:: len(names) // 3]:
        who, take = name.split("_")[-2:]
        clip = synthetic.generate(behaviour, who, int(take), seed=1, duration_s=1.0)
        assert (clip.name, clip.subject, clip.behaviour) == (name, who, behaviour)
        assert clip.source == "built-in performer"


@on_every_behaviour
def test_the_same_seed_gives_the_same_bytes(behaviour: str) -> None:
    first, again, other = (synthetic.generate(behaviour, "p2", 3, seed=seed) for seed in (5, 5, 6))
    for field in ("root_m", "world_from_root", "angles_rad"):
        assert getattr(first, field).tobytes() == getattr(again, field).tobytes()
    assert np.mean(np.abs(first.angles_rad - other.angles_rad)) > np.deg2rad(1.0)


def test_duration_and_rate_are_as_asked() -> None:
    clip = synthetic.generate("golf", "p1", 1, seed=0, duration_s=5.0, rate_hz=60.0)
    assert clip.duration_s == pytest.approx(5.0)
    assert clip.rate_hz == 60.0


def test_unknown_names_are_refused_with_the_choices() -> None:
    with pytest.raises(UnknownName, match="boxing"):
        synthetic.take_names("boxin")
    with pytest.raises(UnknownName, match="p1"):
        synthetic.generate("boxing", "nobody", 1, seed=0)
    with pytest.raises(BadInput, match="from 1"):
        synthetic.generate("boxing", "p1", 0, seed=0)


def test_performers_that_no_list_names_are_others_of_the_same_kind() -> None:
    source = open_motion_source("builtin", None, seed=1, rate_hz=None)
    listed = {source.subject(name) for name in source.names()}
    assert not listed & set(synthetic.UNLISTED_PERFORMERS)
    source.check("golf_p128_06")
    for name in ("golf_p129_01", "golf_p128_07", "golff_p128_01"):
        with pytest.raises(UnknownName):
            source.check(name)
    clips = [source.load(f"walking_{who}_01") for who in ("p9", "p65", "p66")]
    assert len({clip.skeleton.bone_m.tobytes() for clip in clips}) == 3


def test_performers_differ_in_proportions_as_people_do() -> None:
    skeletons = [synthetic.performer_skeleton(who) for who in synthetic.performer_names()]
    standard = humanoid24.standard_skeleton()
    assert len(skeletons) >= 6
    lengths = np.array([s.length_m for s in skeletons])
    assert np.all(np.abs(lengths / standard.length_m - 1.0) < 0.35)
    for bone in ("lfemur", "ltibia", "lhumerus", "lradius"):
        assert np.ptp(lengths[:, standard.index(bone)]) > 0.015
    for s in skeletons:
        for bone in ("femur", "tibia", "humerus", "hipjoint", "clavicle"):
            left, right = (s.bone_m[s.index(side + bone)] for side in "lr")
            np.testing.assert_allclose(left, right * [1.0, -1.0, 1.0], atol=1e-12)


def test_a_population_is_other_people_of_the_same_spread() -> None:
    many = synthetic.sample_skeletons(400, seed=3)
    lengths = np.array([person.length_m for person in many])
    own = np.array([synthetic.performer_skeleton(who).length_m for who in synthetic.performer_names()])
    nearest = np.abs(lengths[:, None] - own).max(axis=-1).min()
    assert nearest > 1e-3, "a performer among them"
    standard = humanoid24.standard_skeleton()
    np.testing.assert_allclose(lengths.mean(axis=0), standard.length_m, rtol=0.02)
    spread_m = dict(zip(standard.names, lengths.std(axis=0), strict=True))
    for bone, published_m in (("lfemur", 0.027), ("ltibia", 0.018), ("lhumerus", 0.014), ("head", 0.006)):
        assert 0.5 * published_m < spread_m[bone] < 1.2 * published_m


def test_a_population_depends_on_its_seed_and_not_on_its_size() -> None:
    few, many, other = (synthetic.sample_skeletons(count, seed) for count, seed in ((3, 5), (9, 5), (3, 6)))
    for one, same in zip(few, many, strict=False):
        np.testing.assert_array_equal(one.bone_m, same.bone_m)
    lengths = np.array([person.length_m for person in (*many, *other)])
    assert len(np.unique(lengths.round(9), axis=0)) == 12


def test_the_performers_are_the_ones_that_results_were_measured_on() -> None:
    """Rounded, since the last bit of a sine depends on the computer."""
    assert synthetic.REFERENCE_PERFORMERS == ("p1", "p2", "p3", "p4", "p5", "p6", "p7", "p8")
    bones_m = np.round([synthetic.performer_skeleton(who).bone_m for who in synthetic.REFERENCE_PERFORMERS], 9) + 0.0
    assert blake2b(bones_m.tobytes(), digest_size=8).hexdigest() == "b81940f776d8d094"


@pytest.mark.long
@pytest.mark.parametrize(
    ("behaviour", "digest"),
    [
        ("walking", "13fce5ce3bfc2846"),
        ("boxing", "391508eb34398014"),
        ("jumping", "e42501416a1702df"),
        ("golf", "01f3975dfdf6f3df"),
        ("table_tennis", "0d839e045ea8a91b"),
    ],
)
def test_motion_of_the_reference_performers_is_what_results_were_measured_on(behaviour: str, digest: str) -> None:
    """Rounded to 1e-6 rad and m; the digests are those of the commit before there were others."""
    said = blake2b(digest_size=8)
    for number, who in enumerate(synthetic.REFERENCE_PERFORMERS):
        clip = synthetic.generate(behaviour, who, 1 + number % 6, seed=7, duration_s=1.0, rate_hz=30.0)
        for array in (clip.root_m, clip.world_from_root, clip.angles_rad):
            said.update((np.round(array, 6) + 0.0).tobytes())
    assert said.hexdigest() == digest


def test_there_are_64_people() -> None:
    names = synthetic.performer_names()
    assert names == tuple(f"p{number}" for number in range(1, 65))
    lengths = np.array([synthetic.performer_skeleton(who).length_m for who in names])
    apart_m = np.abs(lengths[:, None] - lengths).max(axis=-1) + np.eye(len(names))
    assert apart_m.min() > 1e-3
    left = [who for who in STYLED if performer_habits(who).hand == "l"]
    assert 0.02 < len(left) / len(STYLED) < 0.25  # a tenth of people
    style = [performer_habits(who).style for who in STYLED]
    assert len({(s.swing, s.pace, s.speed) for s in style}) == len(STYLED)
    assert all(performer_habits(who).style == Style(left_handed=who in ("p3", "p6")) for who in names[:8])


@pytest.mark.long
@on_every_behaviour
def test_every_style_moves_within_the_limits_of_joints(behaviour: str) -> None:
    low, high = humanoid24.limits_rad().T
    for number, who in enumerate(STYLED):
        if number % len(synthetic.BEHAVIOURS) == synthetic.BEHAVIOURS.index(behaviour):
            clip = synthetic.generate(behaviour, who, 1 + number % 6, seed=7, duration_s=4.0, rate_hz=60.0)
            assert np.all((clip.angles_rad >= low) & (clip.angles_rad <= high)), clip.name
            assert inspect_clip(clip).doubts == (), clip.name


@pytest.mark.long
def test_walkers_differ_in_their_gait() -> None:
    """Standard deviation over performers of the mean of each hinge; that of CMU's walkers is 6 to 8.5 deg."""
    spread_deg = []
    for group in (synthetic.REFERENCE_PERFORMERS, STYLED[::7]):
        clips = [synthetic.generate("walking", who, 1, seed=7, duration_s=3.0, rate_hz=30.0) for who in group]
        means = np.rad2deg([clip.angles_rad.mean(axis=0) for clip in clips])
        spread_deg.append(float(np.sqrt(means.var(axis=0, ddof=1).mean())))
    assert spread_deg[0] < 4.0 < 4.8 < spread_deg[1] < 9.0


@pytest.mark.long
@on_every_take
def test_joints_stay_within_limits_and_bend_the_right_way(behaviour: str, who: str, take: int) -> None:
    clip, _ = made(behaviour, who, take)
    low, high = humanoid24.limits_rad().T
    assert np.all(clip.angles_rad >= low)
    assert np.all(clip.angles_rad <= high)
    degrees = dict(zip(clip.skeleton.dof_names, np.rad2deg(clip.angles_rad).T, strict=True))
    for side in "lr":
        assert np.all((degrees[f"{side}tibia.rx"] > 5.0) & (degrees[f"{side}tibia.rx"] < 140.0))
        assert np.all((degrees[f"{side}radius.rx"] > 3.0) & (degrees[f"{side}radius.rx"] < 150.0))
        assert np.all(np.abs(degrees[f"{side}wrist.ry"]) < 110.0)
        assert np.all(np.abs(degrees[f"{side}hand.rx"]) < 60.0)
        for channel in ("ry", "rz"):
            assert np.all(np.abs(degrees[f"{side}clavicle.{channel}"]) < 10.0)


@on_every_take
def test_planted_soles_do_not_slip(behaviour: str, who: str, take: int) -> None:
    clip, pose = made(behaviour, who, take)
    for side in "lr":
        planted = 0
        for point in sole(clip, pose, side).values():
            down = (point[1:, 2] < 0.0005) & (point[:-1, 2] < 0.0005)
            slip = speed_m_s(point * [1.0, 1.0, 0.0], clip.rate_hz)
            assert slip[down].max(initial=0.0) < 0.02
            planted += int(down.sum())
        assert planted > 0.3 * len(clip)


@on_every_take
def test_feet_neither_float_nor_sink(behaviour: str, who: str, take: int) -> None:
    clip, pose = made(behaviour, who, take)
    soles = [point for side in "lr" for point in sole(clip, pose, side).values()]
    assert min(point[:, 2].min() for point in soles) > -0.002
    air = airborne(clip, pose)
    if behaviour != "jumping":
        assert not air.any()


@pytest.mark.parametrize(("who", "take"), TAKES)
def test_flight_is_ballistic_and_as_long_as_a_jump(who: str, take: int) -> None:
    clip, pose = made("jumping", who, take)
    flights = runs(airborne(clip, pose))
    assert len(flights) >= 3
    fall = np.diff(clip.root_m[:, 2], 2) * clip.rate_hz**2
    for start, end in flights:
        assert 0.25 <= (end - start) / clip.rate_hz <= 0.6
        np.testing.assert_allclose(fall[start + 1 : end - 4], -GRAVITY_M_S2, atol=0.1)
        across = np.diff(clip.root_m[start + 1 : end - 2, :2], 2, axis=0) * clip.rate_hz**2
        assert np.abs(across).max() < 6.0  # the pelvis swings a little about the centre of mass


@pytest.mark.parametrize(("who", "take"), TAKES)
def test_walking_speed_is_a_walk(who: str, take: int) -> None:
    clip, _ = made("walking", who, take)
    second = int(clip.rate_hz)
    mean = np.linalg.norm(clip.root_m[second:, :2] - clip.root_m[:-second, :2], axis=1)
    path = speed_m_s(clip.root_m * [1.0, 1.0, 0.0], clip.rate_hz)
    strides = np.convolve(path, np.ones(second) / second, mode="valid")
    assert strides.min() > 0.8
    assert strides.max() < 1.8
    assert mean.max() < 1.8


def test_walkers_turn_both_ways() -> None:
    turned = []
    for who, take in TAKES:
        clip, _ = made("walking", who, take)
        m = forward_kinematics(clip.skeleton, clip.root_m, clip.world_from_root, clip.angles_rad).world_from_bone[
            :, 2, :, 0
        ]
        heading = np.unwrap(np.arctan2(m[:, 1], m[:, 0]))
        turned += [heading.max() - heading[0], heading.min() - heading[0]]
    assert max(turned) > np.pi / 2
    assert min(turned) < -np.pi / 2


@pytest.mark.parametrize(("who", "take"), TAKES)
def test_arms_swing_against_the_legs(who: str, take: int) -> None:
    """When a foot is farthest ahead, the hand of the same side is behind the other hand."""
    clip, pose = made("walking", who, take)
    s = clip.skeleton
    ahead = pose.world_from_bone[:, s.index("thorax"), :, 0] * [1.0, 1.0, 0.0]

    def lead(bone: str) -> Floats:
        apart = pose.end_m[:, s.index(f"l{bone}")] - pose.end_m[:, s.index(f"r{bone}")]
        out: Floats = np.sum(apart * ahead, axis=1)
        return out

    feet, hands = lead("foot"), lead("wrist")
    apart = np.abs(feet) > 0.8 * np.quantile(np.abs(feet), 0.95)
    assert np.mean(feet[apart] * hands[apart] < 0.0) > 0.95


@pytest.mark.parametrize(("who", "take"), TAKES)
def test_golfers_keep_both_hands_on_the_grip(who: str, take: int) -> None:
    clip, pose = made("golf", who, take)
    s = clip.skeleton
    apart = np.linalg.norm(pose.end_m[:, s.index("lwrist")] - pose.end_m[:, s.index("rwrist")], axis=1)
    assert apart.min() > 0.05
    assert apart.max() < 0.12
    assert speed_m_s(pose.end_m[:, s.index("lwrist")], clip.rate_hz).max() > 3.0


@pytest.mark.parametrize(("behaviour", "fastest_m_s"), [("boxing", (3.0, 12.0)), ("table_tennis", (2.5, 12.0))])
@pytest.mark.parametrize(("who", "take"), TAKES)
def test_hands_strike_as_fast_as_people_do(
    behaviour: str, fastest_m_s: tuple[float, float], who: str, take: int
) -> None:
    clip, pose = made(behaviour, who, take)
    chest = pose.end_m[:, clip.skeleton.index("thorax")]
    fastest = max(
        speed_m_s(pose.end_m[:, clip.skeleton.index(f"{side}hand")] - chest, clip.rate_hz).max() for side in "lr"
    )
    assert fastest_m_s[0] < fastest < fastest_m_s[1]


@on_every_take
def test_motion_is_smooth_and_never_frozen(behaviour: str, who: str, take: int) -> None:
    clip, _ = made(behaviour, who, take)
    speed = np.rad2deg(np.diff(clip.angles_rad, axis=0)) * clip.rate_hz
    jump = np.abs(np.diff(speed, axis=0))
    assert np.abs(speed).max() < 2500.0
    assert jump.max() < 1500.0
    # twice differentiable: the third difference of a kink would not shrink with the step
    assert np.rad2deg(clip.angles_rad).std(axis=0).min() > 0.15
    half_second = int(0.5 * clip.rate_hz)
    still = np.abs(clip.angles_rad[half_second:] - clip.angles_rad[:-half_second]).max(axis=1)
    assert np.rad2deg(still).min() > 0.1


@on_every_take
def test_inspection_finds_nothing(behaviour: str, who: str, take: int) -> None:
    found = inspect_clip(made(behaviour, who, take)[0])
    assert found.spikes == ()
    assert found.frozen == ()
    assert found.doubts == ()
    assert found.limits_share == 0.0


@on_every_behaviour
def test_a_take_is_made_quickly(behaviour: str) -> None:
    spent_s = []
    for take in (1, 2, 3):
        start_s = time.process_time()
        synthetic.generate(behaviour, "p1", take, seed=99)
        spent_s.append(time.process_time() - start_s)
    assert min(spent_s) < 1.0  # of 20 s
