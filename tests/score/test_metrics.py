"""Every metric against a value worked out by hand."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.estimate import Origin, Status
from harness.core.humanoid24 import pack, standard_skeleton, unpack
from harness.errors import BadInput, ShapeError
from harness.score import angles, contact, positions, timing
from harness.score.metrics import DEFINITIONS, FRAME_METRICS
from harness.score.pair import Pair, compute_poses, hinged_bones
from harness.score.score import score_estimate
from tests.scored_run import FRAMES, RATE_HZ, Judge

SKELETON = standard_skeleton()
OWN_VALUE = ("jitter_m_s3", "foot_skate_mm_s", "penetration_mm", "float_mm")
"""Metrics of one motion: of the truth they give the truth's own value, printed beside them, not zero."""


def turned(qpos: Floats, rotation_vector_rad: Sequence[float]) -> Floats:
    """The whole motion turned about the world's origin."""
    root_m, quaternion, angles_rad = unpack(qpos)
    q = rotations.exp(np.asarray(rotation_vector_rad, dtype=float))
    return pack(rotations.rotate(q, root_m), rotations.multiply(q, quaternion), angles_rad)


def test_the_tables_agree() -> None:
    assert set(FRAME_METRICS) == {name for name, d in DEFINITIONS.items() if d.pool != "none"}
    endings = {"deg": "_deg", "mm": "_mm", "mm/s": "_mm_s", "m/s³": "_m_s3", "ms": "_ms"}
    for name, definition in DEFINITIONS.items():
        assert definition.unit in {*endings, "frames", "frames/s", "share", "x"}, name
        assert name.endswith(endings.get(definition.unit, "")), name
        assert definition.version >= 1, name


def test_a_larger_body_in_the_right_pose_is_off_by_as_much_as_it_is_larger(judge: Judge, truth_qpos: Floats) -> None:
    """Angles know nothing of lengths; each joint is off by a tenth of its distance from the root."""
    larger = SKELETON.with_bones(1.1 * SKELETON.bone_m)
    scores = judge(truth_qpos, estimate_skeleton=larger)
    for name in ("joint_angle_mean_deg", "mpjre_deg", "root_position_mm", "root_angle_deg"):
        assert scores.metrics[name] == 0.0, name
    reach_m = np.linalg.norm(compute_poses(SKELETON, truth_qpos).joints_m - truth_qpos[:, None, :3], axis=2)
    np.testing.assert_allclose(scores.per_frame["mpjpe_mm"], 100.0 * reach_m.mean(axis=1), rtol=1e-9)
    np.testing.assert_allclose(scores.per_frame["mpjpe_root_mm"], 100.0 * reach_m.mean(axis=1), rtol=1e-9)


def test_one_bone_too_long_moves_what_it_carries(judge: Judge, truth_qpos: Floats) -> None:
    """A right forearm 20 mm too long takes wrist, hand's joint and fingertips along: three joints of 25."""
    bone_m = np.array(SKELETON.bone_m)
    forearm = SKELETON.index("rradius")
    bone_m[forearm] *= 1.0 + 0.02 / SKELETON.length_m[forearm]
    scores = judge(truth_qpos, estimate_skeleton=SKELETON.with_bones(bone_m))
    assert scores.metrics["mpjpe_mm"] == pytest.approx(20.0 * 3 / 25, rel=1e-9)
    off = {name: value for name, value in scores.per_joint["mpjpe_mm"].items() if value > 1e-9}
    assert off == pytest.approx({"rradius": 20.0, "rwrist": 20.0, "rhand": 20.0}, rel=1e-9)
    assert scores.metrics["joint_angle_mean_deg"] == 0.0


def test_the_truth_scores_zero(judge: Judge, truth_qpos: Floats) -> None:
    found = judge(truth_qpos).metrics
    beside = {
        "jitter_m_s3": "jitter_true_m_s3",
        "foot_skate_mm_s": "foot_skate_true_mm_s",
        "penetration_mm": "penetration_true_mm",
        "float_mm": "float_true_mm",
    }
    for name, value in found.items():
        if name in beside:
            assert value == found[beside[name]], name
        elif name == "mpjpe_pa_mm":
            assert value == pytest.approx(0.0, abs=1e-9)
        elif (
            DEFINITIONS[name].unit not in ("frames", "share", "frames/s") and "true" not in name and "step" not in name
        ):
            assert value == 0.0, name
    assert (found["frames_matched"], found["frames_expected"], found["coverage"]) == (FRAMES, FRAMES, 1.0)


def test_a_translation_is_exactly_that_far(judge: Judge, truth_qpos: Floats) -> None:
    moved = truth_qpos.copy()
    moved[:, :3] += [0.03, 0.0, -0.04]
    found = judge(moved).metrics
    for name in ("mpjpe", "root_position", "upper_position", "lower_position", "hands_position", "feet_position"):
        assert found[f"{name}_mm"] == pytest.approx(50.0, abs=1e-9), name
    for name in ("mpjpe_root_mm", "mpjpe_pa_mm", "mpjve_mm_s", "root_drift_mm_s", "joint_angle_mean_deg", "mpjre_deg"):
        assert found[name] == pytest.approx(0.0, abs=1e-8), name
    assert found["jitter_m_s3"] == pytest.approx(found["jitter_true_m_s3"], rel=1e-6)


def test_a_drift_is_its_speed(judge: Judge, truth_qpos: Floats) -> None:
    moved = truth_qpos.copy()
    moved[:, :3] += np.arange(FRAMES)[:, None] / RATE_HZ * [0.003, 0.004, 0.0] + [0.1, 0.0, 0.0]
    found = judge(moved).metrics
    assert found["root_drift_mm_s"] == pytest.approx(5.0, abs=1e-9)
    assert found["mpjve_mm_s"] == pytest.approx(5.0, abs=1e-6)


@pytest.mark.parametrize("angle_deg", [-190.0, -30.0, 1e-6, 90.0, 179.0])
def test_a_turn_about_the_vertical_moves_the_root_and_no_joint(
    judge: Judge, truth_qpos: Floats, angle_deg: float
) -> None:
    found = judge(turned(truth_qpos, [0.0, 0.0, np.deg2rad(angle_deg)])).metrics
    expected = abs((angle_deg + 180.0) % 360.0 - 180.0)
    assert found["root_angle_deg"] == pytest.approx(expected, abs=1e-9)
    assert found["root_heading_deg"] == pytest.approx(expected, abs=1e-9)
    for name in ("joint_angle_mean_deg", "mpjre_deg", "mpjre_axis_angle_deg", "joint_geodesic_global_deg"):
        assert found[name] == pytest.approx(0.0, abs=1e-9), name
    assert found["mpjpe_pa_mm"] == pytest.approx(0.0, abs=1e-9)


def test_the_best_rotation_is_never_a_mirror_image(truth_qpos: Floats) -> None:
    truth = compute_poses(SKELETON, truth_qpos)
    turned_m = truth.joints_m[..., [1, 2, 0]] + [1.0, -2.0, 3.0]
    for joints_m, low_mm, high_mm in ((turned_m, 0.0, 1e-9), (truth.joints_m * [1.0, -1.0, 1.0], 20.0, 500.0)):
        pair = Pair(truth, replace(truth, joints_m=joints_m), np.arange(FRAMES), RATE_HZ)
        error_mm = positions.mpjpe_pa_mm(pair)
        assert low_mm <= error_mm.min() <= error_mm.max() < high_mm


def test_one_hinge_off_is_its_share_of_48(judge: Judge, truth_qpos: Floats) -> None:
    root_m, quaternion, angles_rad = unpack(truth_qpos)
    dof = SKELETON.dof_names.index("lradius.rx")
    angles_rad[:, dof] += np.deg2rad(12.0)
    scores = judge(pack(root_m, quaternion, angles_rad))
    found = scores.metrics
    assert found["joint_angle_mean_deg"] == pytest.approx(12.0 / 48)
    assert found["joint_angle_rms_deg"] == pytest.approx(12.0 / np.sqrt(48))
    assert found["mpjre_deg"] == pytest.approx(12.0 / 22)
    assert found["joint_geodesic_global_deg"] == pytest.approx(12.0 * 3 / 22)  # forearm, wrist and hand turn with it
    assert found["sip_error_deg"] == pytest.approx(0.0, abs=1e-9)
    assert scores.per_joint["joint_angle_mean_deg"]["lradius.rx"] == pytest.approx(12.0)
    assert scores.per_joint["joint_angle_rms_deg"]["lradius.rx"] == pytest.approx(12.0)
    assert scores.per_joint["mpjre_deg"]["lradius"] == pytest.approx(12.0)
    assert sum(scores.per_joint["mpjre_deg"].values()) == pytest.approx(12.0)
    assert found["lower_position_mm"] == pytest.approx(0.0, abs=1e-9)
    right_hand, left_hand = (scores.per_joint["mpjpe_mm"][hand] for hand in ("rhand", "lhand"))
    assert right_hand == pytest.approx(0.0, abs=1e-9)
    assert found["hands_position_mm"] == pytest.approx(left_hand / 2)


def test_a_thigh_off_is_a_quarter_of_the_four_sip_bones(judge: Judge, truth_qpos: Floats) -> None:
    root_m, quaternion, angles_rad = unpack(truth_qpos)
    angles_rad[:, SKELETON.dof_names.index("lfemur.rz")] += np.deg2rad(8.0)  # the outermost of its three hinges
    found = judge(pack(root_m, quaternion, angles_rad)).metrics
    assert found["sip_error_deg"] == pytest.approx(2.0)
    assert found["mpjre_deg"] == pytest.approx(8.0 / 22)


def test_a_full_turn_of_a_hinge_is_no_error(judge: Judge, truth_qpos: Floats) -> None:
    wound = truth_qpos.copy()
    wound[:, 7:] += 2.0 * np.pi * np.arange(-24, 24)
    assert judge(wound).metrics["joint_angle_mean_deg"] == pytest.approx(0.0, abs=1e-10)


def test_axis_angle_components_of_a_bone_at_rest(judge: Judge) -> None:
    still = pack(np.zeros((FRAMES, 3)), np.tile(rotations.IDENTITY, (FRAMES, 1)), np.zeros((FRAMES, 48)))
    bent = still.copy()
    bent[:, 7:] = pack(np.zeros(3), rotations.IDENTITY, np.eye(48)[SKELETON.dof_names.index("head.rz")] * 0.3)[7:]
    status, step = np.zeros(FRAMES, dtype=int), np.full(FRAMES, np.nan)
    found = score_estimate(SKELETON, RATE_HZ, still, bent, np.arange(FRAMES), status, step).metrics
    assert found["mpjre_axis_angle_deg"] == pytest.approx(np.rad2deg(0.3) / (22 * 3))
    assert found["lag_ms"] is None  # nothing moves, so no shift is better than another
    assert found["fps"] is None


def test_twenty_two_bones_can_turn() -> None:
    assert len(hinged_bones(SKELETON)) == 22


def test_a_constant_jerk_is_the_jitter(judge: Judge, truth_qpos: Floats) -> None:
    t = np.arange(FRAMES) / RATE_HZ
    still = np.repeat(truth_qpos[:1], FRAMES, axis=0)
    still[:, 0] += 2.5 * t**3 / 6.0
    status, step = np.zeros(FRAMES, dtype=int), np.full(FRAMES, np.nan)
    found = score_estimate(SKELETON, RATE_HZ, truth_qpos, still, np.arange(FRAMES), status, step).metrics
    assert found["jitter_m_s3"] == pytest.approx(2.5, rel=1e-6)


@pytest.mark.parametrize("late", [-7, -1, 0, 1, 3, 19])
def test_a_shift_is_its_lag(judge: Judge, truth_qpos: Floats, late: int) -> None:
    index = np.arange(FRAMES)
    shifted = truth_qpos[np.clip(index - late, 0, FRAMES - 1)]
    assert judge(shifted).metrics["lag_ms"] == pytest.approx(1e3 * late / RATE_HZ, abs=1e-6)


@pytest.mark.parametrize("late", [-2.5, 0.3, 4.75])
def test_a_shift_between_frames_is_found_within_a_tenth(judge: Judge, late: float) -> None:
    def motion(t: Floats) -> Floats:
        return np.sin(np.outer(t, np.linspace(1.0, 6.0, 48)))

    t = np.arange(FRAMES) / RATE_HZ
    found = timing.lag_ms(motion(t), motion(t - late / RATE_HZ), np.arange(FRAMES), RATE_HZ)
    assert found == pytest.approx(1e3 * late / RATE_HZ, abs=0.1 * 1e3 / RATE_HZ)


@pytest.mark.parametrize(("frames", "measured"), [(60, True), (59, False)])
def test_a_lag_needs_twenty_frames_within_reach_of_the_truth(frames: int, measured: bool) -> None:
    """Half a second at either end, 20 frames, serves the shifts."""
    motion = np.sin(np.outer(np.arange(frames) / RATE_HZ, np.linspace(1.0, 6.0, 48)))
    found = timing.lag_ms(motion, np.roll(motion, 2, axis=0), np.arange(frames), RATE_HZ)
    assert np.isfinite(found) == measured


def test_steps_below_a_millisecond_have_a_rate() -> None:
    assert timing.step_times_ms(np.array([0.4, 0.6, np.nan]))["fps"] == pytest.approx(2000.0)
    assert np.isnan(timing.step_times_ms(np.zeros(3))["fps"])
    assert np.isnan(list(timing.step_times_ms(np.full(2, np.nan)).values())).all()


def test_a_shift_beyond_the_range_is_not_measured(judge: Judge, truth_qpos: Floats) -> None:
    ramp = np.outer(np.arange(FRAMES) / RATE_HZ, np.full(48, 0.1))
    found = timing.lag_ms(ramp, ramp - 0.1 * 0.8, np.arange(FRAMES), RATE_HZ)
    assert np.isnan(found)


def test_feet_that_slide_skate_at_their_speed() -> None:
    standing = pack(
        np.tile([0.0, 0.0, 0.92], (FRAMES, 1)), np.tile(rotations.IDENTITY, (FRAMES, 1)), np.zeros((FRAMES, 48))
    )
    toe_m = compute_poses(SKELETON, standing[:1]).joints_m[0, 1 + SKELETON.index("lfoot"), 2]
    standing[:, 2] += 0.02 - toe_m  # toes 2 cm up, as they lie inside the foot
    sliding = standing.copy()
    sliding[:, 0] += 0.3 * np.arange(FRAMES) / RATE_HZ
    sliding[:, 2] -= 0.05
    status, step = np.zeros(FRAMES, dtype=int), np.full(FRAMES, np.nan)
    found = score_estimate(SKELETON, RATE_HZ, standing, sliding, np.arange(FRAMES), status, step).metrics
    assert found["foot_skate_mm_s"] == pytest.approx(300.0)
    assert found["penetration_mm"] == pytest.approx(50.0)
    assert found["float_mm"] == 0.0
    for name in ("foot_skate_true_mm_s", "penetration_true_mm", "float_true_mm"):
        assert found[name] == pytest.approx(0.0, abs=1e-9), name
    lifted = standing.copy()
    lifted[:, 2] += 0.03
    assert score_estimate(SKELETON, RATE_HZ, standing, lifted, np.arange(FRAMES), status, step).metrics[
        "float_mm"
    ] == pytest.approx(30.0)


def test_feet_in_the_air_or_in_motion_are_not_in_contact() -> None:
    still = pack(np.zeros((FRAMES, 3)), np.tile(rotations.IDENTITY, (FRAMES, 1)), np.zeros((FRAMES, 48)))
    hopping = still.copy()
    hopping[300:, 2] += 0.06  # for a quarter of the time
    sliding = still.copy()
    sliding[:, 0] += 0.16 * np.arange(FRAMES) / RATE_HZ
    for truth, contacts in ((still, FRAMES - 1), (hopping, 299), (sliding, 0)):
        pose = compute_poses(SKELETON, truth)
        pair = Pair(pose, pose, np.arange(FRAMES), RATE_HZ, contact.ground_m(pose))
        np.testing.assert_array_equal(contact.in_contact(pair).sum(axis=0), [contacts] * 4)
    status, step = np.zeros(FRAMES, dtype=int), np.full(FRAMES, np.nan)
    found = score_estimate(SKELETON, RATE_HZ, sliding, still, np.arange(FRAMES), status, step).metrics
    assert found["foot_skate_mm_s"] is None
    assert found["float_mm"] is None
    assert found["mpjpe_mm"] is not None


def test_differences_never_span_a_gap(judge: Judge, truth_qpos: Floats) -> None:
    index = np.delete(np.arange(FRAMES), [100, 101, 200])
    scores = judge(truth_qpos[index], index)
    assert scores.metrics["frames_matched"] == FRAMES - 3
    assert scores.metrics["mpjve_mm_s"] == 0.0
    assert scores.metrics["jitter_m_s3"] == scores.metrics["jitter_true_m_s3"]
    undefined = np.flatnonzero(np.isnan(scores.per_frame["jitter_m_s3"]))
    np.testing.assert_array_equal(undefined, [0, 1, 2, 100, 101, 102, 198, 199, 200])
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(scores.per_frame["mpjve_mm_s"])), [0, 100, 198])
    jerk = np.nanmax(scores.per_frame["jitter_m_s3"])
    assert jerk == pytest.approx(np.nanmax(judge(truth_qpos).per_frame["jitter_m_s3"]), rel=0.5)


def test_the_warm_up_counts_for_no_score(judge: Judge, truth_qpos: Floats) -> None:
    late = truth_qpos.copy()
    late[:40, 0] += 1.0
    scores = judge(late, warm_up_s=1.0)
    assert scores.metrics["mpjpe_mm"] == 0.0
    assert scores.metrics["frames_warm_up"] == 40
    assert scores.metrics["frames_expected"] == FRAMES - 40
    assert scores.per_frame["mpjpe_mm"][0] == pytest.approx(1000.0)
    assert judge(late).metrics["mpjpe_mm"] == pytest.approx(100.0)


def test_below_the_floor_nothing_is_measured_but_coverage(judge: Judge, truth_qpos: Floats) -> None:
    half = np.arange(FRAMES // 2)
    assert judge(truth_qpos[half], half).metrics["mpjpe_mm"] == 0.0
    fewer = half[:-1]
    found = judge(truth_qpos[fewer], fewer).metrics
    assert found["coverage"] == pytest.approx(199 / 400)
    for name, definition in DEFINITIONS.items():
        assert (found[name] is None) == (definition.unit != "frames" and name != "coverage"), name
    none = judge(truth_qpos[:0], half[:0])
    assert none.metrics["frames_matched"] == 0
    assert none.metrics["mpjpe_mm"] is None


def test_an_estimate_that_is_not_finite_is_not_matched(judge: Judge, truth_qpos: Floats) -> None:
    broken = truth_qpos.copy()
    broken[7, 20] = np.nan
    broken[9, 3:7] = 0.0
    scores = judge(broken)
    assert (scores.metrics["frames_not_finite"], scores.metrics["frames_matched"]) == (2, FRAMES - 2)
    assert scores.metrics["joint_angle_mean_deg"] == 0.0
    np.testing.assert_array_equal(np.flatnonzero(~scores.scored), [7, 9])


def test_an_estimates_quaternion_need_not_be_normed(judge: Judge, truth_qpos: Floats) -> None:
    longer = truth_qpos.copy()
    longer[:, 3:7] *= -1.5
    assert judge(longer).metrics["mpjpe_mm"] == pytest.approx(0.0, abs=1e-9)


def test_status_is_counted_and_steps_are_timed(truth_qpos: Floats) -> None:
    status = np.full(FRAMES, Status.SOLVED)
    status[50:60], status[60:65] = Status.HELD, Status.LOST
    step_ms = np.r_[500.0, np.linspace(1.0, 3.0, FRAMES - 1)]
    scored = SKELETON, RATE_HZ, truth_qpos, truth_qpos, np.arange(FRAMES), status, step_ms
    cpu_ms = 0.5 * step_ms, np.full(FRAMES, np.nan)
    cpu_ms[0][2], cpu_ms[1][:3] = np.nan, (0.5, 0.4, 9.0)
    found = score_estimate(*scored, cpu_ms=cpu_ms, warm_up_s=0.0).metrics
    assert (found["frames_held"], found["frames_lost"]) == (10, 5)
    assert found["first_step_ms"] == 500.0
    assert found["step_p50_ms"] == pytest.approx(2.0)
    assert found["step_p99_ms"] == pytest.approx(2.98)
    assert found["fps"] == pytest.approx(500.0)
    assert found["step_relative"] == pytest.approx(2.0, rel=0.01)
    for untimed in (None, (cpu_ms[0], np.full(FRAMES, np.nan)), (cpu_ms[0], np.zeros(FRAMES))):
        assert score_estimate(*scored, cpu_ms=untimed, warm_up_s=0.0).metrics["step_relative"] is None


def test_fallbacks_are_counted_in_undisturbed_frames(truth_qpos: Floats) -> None:
    """Frame 40 lacks a station, so frames 40 to 59 are disturbed, 0.5 s at 40 Hz; and so are 20 after a gap."""
    index = np.r_[0:80, 81:FRAMES]
    origin, complete = np.full(len(index), Origin.MODEL), np.ones(len(index), bool)
    complete[40] = False
    origin[40:60], origin[80:100], origin[30] = Origin.FALLBACK, Origin.FALLBACK, Origin.BRIDGED
    shown = truth_qpos[index]
    scored = SKELETON, RATE_HZ, truth_qpos, shown, index, np.zeros(len(index), int), np.full(len(index), np.nan)

    def judge_origin(**changes: np.ndarray) -> Mapping[str, float | None]:
        given = {"origin": origin, "complete": complete} | changes
        return score_estimate(*scored, warm_up_s=0.0, **given).metrics

    found = judge_origin()
    assert (found["frames_fallback"], found["frames_bridged"], found["fallback_share"]) == (40, 1, 0.0)
    more = origin.copy()
    more[60], more[39], more[100] = Origin.FALLBACK, Origin.FALLBACK, Origin.FALLBACK
    assert judge_origin(origin=more)["fallback_share"] == pytest.approx(3.0 / (len(index) - 40))
    assert judge_origin(complete=np.zeros(len(index), bool))["fallback_share"] is None


def test_input_that_makes_no_sense_is_refused(truth_qpos: Floats) -> None:
    rows = np.arange(FRAMES)
    zeros = np.zeros(FRAMES)
    for index in (rows[::-1], np.zeros(FRAMES, dtype=int), rows + 1):
        with pytest.raises(BadInput, match="frame_index"):
            score_estimate(SKELETON, RATE_HZ, truth_qpos, truth_qpos, index, rows * 0, zeros)
    with pytest.raises(ShapeError, match="step_ms"):
        score_estimate(SKELETON, RATE_HZ, truth_qpos, truth_qpos, rows, rows * 0, zeros[1:])
    with pytest.raises(ShapeError, match="estimate_qpos"):
        score_estimate(SKELETON, RATE_HZ, truth_qpos, truth_qpos[:, :54], rows, rows * 0, zeros)
    with pytest.raises(ShapeError, match=r"angle_sigma_rad.*\(400, 47\).*\(400, 48\)"):
        score_estimate(
            SKELETON, RATE_HZ, truth_qpos, truth_qpos, rows, rows * 0, zeros, angle_sigma_rad=np.ones((FRAMES, 47))
        )
    with pytest.raises(BadInput, match="truth"):
        score_estimate(SKELETON, RATE_HZ, truth_qpos * np.nan, truth_qpos, rows, rows * 0, zeros)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3), st.lists(st.floats(-1.8, 1.8), min_size=3, max_size=3))
def test_the_chord_and_the_quaternions_agree_on_angles(first: list[float], second: list[float]) -> None:
    p, q = rotations.exp(np.array(first)), rotations.exp(np.array(second))
    by_chord = angles.geodesic_deg(rotations.to_matrix(p), rotations.to_matrix(q))
    assert by_chord == pytest.approx(np.rad2deg(rotations.angle_between_rad(p, q)), abs=1e-5)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_laws_over_random_motion(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frames = 12

    def motion() -> Floats:
        quaternion = rotations.exp(rng.normal(size=(frames, 3)))
        return pack(rng.normal(size=(frames, 3)), quaternion, rng.uniform(-1.5, 1.5, (frames, 48)))

    a, b = compute_poses(SKELETON, motion()), compute_poses(SKELETON, motion())
    there, back = Pair(a, b, np.arange(frames), RATE_HZ), Pair(b, a, np.arange(frames), RATE_HZ)
    for name, function in FRAME_METRICS.items():
        if "true" in name or name in OWN_VALUE:
            continue
        np.testing.assert_allclose(function(there), function(back), rtol=1e-7, atol=1e-7, err_msg=name)
    mean, rms = (FRAME_METRICS[f"joint_angle_{kind}_deg"](there) for kind in ("mean", "rms"))
    assert (mean <= rms + 1e-9).all()
    rms_mm = np.sqrt(np.mean(positions.joint_errors_mm(there) ** 2, axis=1))
    assert (FRAME_METRICS["mpjpe_pa_mm"](there) <= rms_mm).all()  # the mean is below the RMS, the best fit below any
