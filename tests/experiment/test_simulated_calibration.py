"""What a method is told comes from a stream; what it is judged on is the same whatever it was told."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.body import Body
from harness.calibrate import POSES, SkeletonPrior, fit_skeleton_prior, pose_configuration
from harness.core import rotations
from harness.core.motion import BodyMotion
from harness.core.split import ClipPart
from harness.errors import BadInput, Outcome
from harness.experiment import engine
from harness.experiment.clip_evaluation import ClipEvaluation
from harness.experiment.methods.method_run import run_method
from harness.experiment.scenarios.scenario import CalibrationSettings, Scenario
from harness.experiment.scenarios.scenario_motion import ScenarioMotion
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.experiment.simulated_calibration import (
    PerformerCalibration,
    TrackerSession,
    measure_calibration_errors,
    simulate_poses_calibration,
    simulate_tpose_calibration,
)
from harness.mocap import open_motion_source, synthetic
from harness.reconstruct import FittedMeanPose, MeanPose, make_method
from harness.report.run.text import run_table
from harness.results import read_summary, select_cells
from harness.simulate import Simulation, exact_calibration, simulate_tracker
from harness.simulate.physics import Physics
from harness.stream import TrackerFrame
from tests.joint_centres import joint_centres_m

PREVIOUS = make_method("ik:previous")

BESIDE = CalibrationSettings(beside_m=0.015, turned_deg=180.0)
SMALL = Scenario(
    name="small",
    motion=ScenarioMotion(
        "builtin", ("walking_p1_01", "boxing_p2_01"), ("walking", "boxing"), ("walking_p3_01",), longest_s=2.5
    ),
    stations=load_scenario("demo").stations,
    methods=("ik:previous", "mean_pose"),
)
KINDS = ("exact", "kim2012", "tpose", "liu2011", "poses")


def setting(scenario: Scenario = SMALL, clip: str = "walking_p1_01") -> ClipEvaluation:
    source = open_motion_source("builtin", None, seed=scenario.seed, rate_hz=None)
    return ClipEvaluation(scenario, source, ClipPart(clip), "walking")


def same_frames(a: tuple[TrackerFrame, ...], b: tuple[TrackerFrame, ...]) -> bool:
    """Bit for bit, NaN like NaN."""

    def told(frame: TrackerFrame) -> bytes:
        arrays = frame.measured_s, frame.position_m, frame.tracker_from_station, frame.quality, frame.suspect
        return b"".join(array.tobytes() for array in arrays)

    return [told(frame) for frame in a] == [told(frame) for frame in b]


def plainly(scenario: Scenario) -> Simulation:
    """The take worn as if nobody had ever calibrated."""
    made = setting(scenario)
    return simulate_tracker(
        made.body, made.subject.take, scenario.nominal_mounts, scenario.device, scenario.noise_model, seed=scenario.seed
    )


@pytest.mark.parametrize("noise", ["clean", "default"])
def test_without_calibrating_everything_is_as_it_was(noise: str) -> None:
    scenario = replace(SMALL, noise=noise)  # type: ignore[arg-type]
    made = setting(scenario)
    assert same_frames(made.simulation.frames, plainly(scenario).frames)
    assert made.performer_calibration.body is made.body
    assert made.performer_calibration.notes == ()
    assert made.performer_calibration.errors == {}
    for name in ("mount_m", "bone_from_station", "world_from_tracker", "tracker_origin_m"):
        exact, known = (getattr(c, name) for c in (made.simulation.calibration, made.performer_calibration.calibration))
        np.testing.assert_array_equal(exact, known)
    assert "calibrating" not in made.conditions_of(PREVIOUS, "pos+ori")


def test_who_stands_model_how_is_no_input_where_nobody_does() -> None:
    told = [
        setting(replace(SMALL, calibrating=CalibrationSettings(miss_deg=deg))).conditions_of(PREVIOUS, "pos+ori")
        for deg in (1, 5)
    ]
    assert told[0] == told[1]
    found = [
        setting(replace(SMALL, calibration="tpose", calibrating=CalibrationSettings(miss_deg=deg))).conditions_of(
            PREVIOUS, ""
        )
        for deg in (1, 5)
    ]
    assert {key for key in found[0] if found[0][key] != found[1][key]} == {"calibrating"}


def test_where_trackers_really_sit_is_an_input() -> None:
    plain, beside = (
        setting(replace(SMALL, calibrating=how)).conditions_of(PREVIOUS, "") for how in (CalibrationSettings(), BESIDE)
    )
    assert {key for key in plain if plain[key] != beside[key]} == {"mounts_digest"}


@pytest.mark.parametrize("how", [CalibrationSettings(), BESIDE], ids=["nominal", "beside"])
def test_the_stream_under_test_is_the_same_whatever_the_calibration(how: CalibrationSettings) -> None:
    streams = [setting(replace(SMALL, calibration=kind, calibrating=how)).simulation for kind in KINDS]  # type: ignore[arg-type]
    for stream in streams[1:]:
        assert same_frames(stream.frames, streams[0].frames)
        np.testing.assert_array_equal(stream.truth_qpos, streams[0].truth_qpos)
    assert same_frames(streams[0].frames, plainly(SMALL).frames) == (how == CalibrationSettings())


def test_exact_knows_where_trackers_really_sit() -> None:
    """Whatever the straps, perfect trackers are where the exact calibration says."""
    scenario = replace(SMALL, noise="clean", calibrating=BESIDE)
    made = setting(scenario)
    known = made.performer_calibration.calibration
    off_m = np.linalg.norm(known.mount_m - setting().performer_calibration.calibration.mount_m, axis=1)
    assert off_m.min() > 0.002
    fitted = made.fit_method(PREVIOUS, "ik:previous")
    qpos, *_ = run_method(fitted, known, made.simulation.frames)
    there_m = made.simulation.truth_qpos[made.simulation.frame_index][:, :3]
    assert np.linalg.norm(qpos[40:, :3] - there_m[40:], axis=1).mean() < 0.02


def session(scenario: Scenario = SMALL) -> TrackerSession:
    return setting(scenario).session


def test_a_perfect_model_of_perfect_trackers_is_calibrated_exactly() -> None:
    scenario = replace(
        SMALL, noise="clean", calibration="tpose", calibrating=CalibrationSettings(miss_deg=0.0, turned_deg=180.0)
    )
    errors = setting(scenario).performer_calibration.errors
    assert errors["mount_deg"] < 0.01
    assert all(errors[name] < 0.1 for name in ("mount_mm", "room_origin_mm"))
    assert errors["room_heading_deg"] < 0.01


def test_kim_s_maps_make_a_perfect_tpose_the_character_s() -> None:
    """Nominal straps and a perfect T-pose: the mapped readings are those that the exact calibration predicts.

    A calibration with any mount would have an error of it; the equation has none, so none is given.
    """
    scenario = replace(SMALL, noise="clean", calibration="kim2012", calibrating=CalibrationSettings(miss_deg=0.0))
    made = setting(scenario)
    known = made.performer_calibration
    assert set(known.errors) == {"room_heading_deg"}
    assert known.errors["room_heading_deg"] < 0.01
    mapped, true = known.map_stream(made.simulation).frames[30], made.simulation.calibration
    seen = made.simulation.frames[30]
    expected_m = rotations.rotate(true.world_from_tracker, seen.position_m) + true.tracker_origin_m
    np.testing.assert_allclose(mapped.position_m, expected_m, atol=1e-4)
    turn = rotations.multiply(true.world_from_tracker, seen.tracker_from_station)
    assert np.rad2deg(rotations.angle_between_rad(mapped.tracker_from_station, turn).max()) < 0.02
    assert setting(replace(scenario, calibration="exact")).performer_calibration.map_stream(made.simulation) is (
        made.simulation
    )


def test_errors_are_what_they_say() -> None:
    worn = session()
    true, skeleton = worn.true_calibration, worn.body.skeleton
    turn = rotations.exp(np.array([0.0, np.deg2rad(5.0), 0.0]))
    wrong = replace(
        true,
        mount_m=true.mount_m + np.array([0.003, 0.0, 0.004]),
        bone_from_station=rotations.multiply(true.bone_from_station, turn),
        world_from_tracker=rotations.multiply(rotations.about_z(np.deg2rad(-7.0)), true.world_from_tracker),
        tracker_origin_m=true.tracker_origin_m + np.array([0.0, 0.06, -0.08]),
    )
    longer = skeleton.with_bones(skeleton.bone_m * (1.0 + 0.01 / skeleton.length_m)[:, None])
    expected = {"mount_mm": 5.0, "mount_deg": 5.0, "length_mm": 10.0, "room_heading_deg": 7.0, "room_origin_mm": 100.0}
    assert measure_calibration_errors(wrong, longer, worn) == pytest.approx(expected, abs=1e-9)
    assert measure_calibration_errors(true, skeleton, worn) == pytest.approx(dict.fromkeys(expected, 0.0), abs=1e-6)


def test_whoever_misses_the_pose_more_pays_more() -> None:
    """The same draws, four times as large."""
    worn = session(replace(SMALL, noise="clean"))
    few, many = (
        [
            simulate_tpose_calibration(replace(worn, seed=s), miss_rad=np.deg2rad(deg), hold_s=2.0).errors["mount_deg"]
            for s in range(4)
        ]
        for deg in (0.5, 2.0)
    )
    assert np.mean(many) == pytest.approx(4.0 * np.mean(few), rel=0.1)


def test_a_model_that_nobody_takes_for_one_fails_its_cells(tmp_path: Path) -> None:
    """Of two performers who are far off their pose, each cell fails with the reason; nothing stops the run."""
    scenario = replace(SMALL, calibration="tpose", calibrating=CalibrationSettings(miss_deg=30.0))
    with pytest.raises(BadInput, match="Nothing could be run"):
        engine.run(scenario, tmp_path / "run")
    failures = read_summary(tmp_path / "run")["failures"]
    assert len(failures) == 4
    assert all("T-pose" in text or "exchanged" in text for text in failures.values())


def side_by_side(*clips: str, kinds: Sequence[str]) -> Scenario:
    motion = replace(SMALL.motion, test=clips, behaviours=("moving",))
    return replace(
        SMALL, motion=motion, methods=("ik:previous",), calibrating=BESIDE, vary={"calibration": list(kinds)}
    )


def test_calibrations_print_side_by_side(tmp_path: Path) -> None:
    """And a run goes on where it was."""
    scenario = side_by_side("walking_p1_01", kinds=KINDS)
    assert engine.run(scenario, tmp_path) is Outcome.PASS
    cells = list(select_cells(tmp_path))
    assert [cell.calibration for cell in cells] == list(KINDS)
    for cell in cells:
        assert bool(cell.calibration_errors) == (cell.calibration != "exact")
        assert cell.calibration == cell.varied["calibration"]
        assert (cell.estimate_bone_m == cell.bone_m).all() == (cell.calibration not in ("poses", "liu2011"))
        np.testing.assert_array_equal(cell.bone_m, cells[0].bone_m)
        np.testing.assert_array_equal(cell.truth_qpos, cells[0].truth_qpos)
    printed = run_table(read_summary(tmp_path))
    assert f"calibration {', '.join(KINDS)}" in printed
    assert all(f"calibration={kind}" in printed for kind in KINDS)
    made = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "cells").iterdir()}
    engine.run(scenario, tmp_path)
    assert {path.name: path.stat().st_mtime_ns for path in (tmp_path / "cells").iterdir()} == made


def test_what_was_learnt_is_shared_while_the_body_is_the_same() -> None:
    exact = setting()
    tpose = exact.with_conditions(replace(SMALL, calibration="tpose"))
    assert tpose is not None
    assert tpose.fit_method(PREVIOUS, "ik:previous") is exact.fit_method(PREVIOUS, "ik:previous")
    assert tpose.performer_calibration.calibration.kind == "tpose"
    assert exact.performer_calibration.calibration.kind == "exact"


@pytest.fixture(scope="module")
def found() -> tuple[TrackerSession, PerformerCalibration, SkeletonPrior]:
    """What eight poses of p2 told."""
    scenario = replace(SMALL, calibration="poses", calibrating=BESIDE)
    made = setting(scenario, "walking_p2_01")
    return made.session, made.performer_calibration, fit_skeleton_prior(list(made.subject.people.values()))


def test_eight_poses_find_bones_mounts_and_room(
    found: tuple[TrackerSession, PerformerCalibration, SkeletonPrior],
) -> None:
    worn, calibrated, space = found
    assert calibrated.calibration.kind == "poses"
    nominal = exact_calibration(worn.body, worn.nominal, worn.tracker)
    untold = measure_calibration_errors(nominal, space.mean_skeleton(worn.body.skeleton), worn)
    assert calibrated.errors["length_mm"] < 0.7 * untold["length_mm"]
    assert calibrated.errors["mount_mm"] < 0.7 * untold["mount_mm"]
    assert calibrated.errors["mount_deg"] < 6.0
    assert calibrated.errors["room_heading_deg"] < 10.0


@pytest.mark.long
@pytest.mark.parametrize("clip", ["walking_p1_01", "walking_p2_01", "walking_p3_01"])
def test_eight_poses_calibrate_under_physics(clip: str) -> None:
    """Bowed, the chest and the head hear too few emitters for a fix, whatever the filter; those poses are left out."""
    straps = CalibrationSettings(beside_m=0.015, turned_deg=15.0)
    scenario = replace(SMALL, physics=Physics(), calibration="poses", calibrating=straps)
    errors = setting(scenario, clip).performer_calibration.errors
    assert errors["mount_mm"] < 25.0
    assert errors["mount_deg"] < 5.0
    assert errors["length_mm"] < 12.0


def test_nothing_of_the_performer_but_the_stream_is_told(
    found: tuple[TrackerSession, PerformerCalibration, SkeletonPrior], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where p1 stands but the stream of p2 is heard, what is found is p2's to the bit; its errors alone are others."""
    worn, calibrated, space = found
    poses = [pose_configuration(pose, worn.body.skeleton) for pose in POSES]
    heard = worn.observe_poses(poses, miss_rad=np.deg2rad(BESIDE.miss_deg), hold_s=BESIDE.hold_s)
    other = session(replace(SMALL, calibrating=CalibrationSettings(beside_m=0.3)))
    assert other.body is not worn.body
    monkeypatch.setattr(TrackerSession, "observe_poses", lambda *_, **__: heard)
    again = simulate_poses_calibration(other, space, miss_rad=0.0, hold_s=3.0)
    for name in ("mount_m", "bone_from_station", "world_from_tracker", "tracker_origin_m"):
        one, two = (getattr(c.calibration, name) for c in (calibrated, again))
        np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(again.body.skeleton.bone_m, calibrated.body.skeleton.bone_m)
    assert again.errors["mount_mm"] > calibrated.errors["mount_mm"] + 100.0


def test_methods_and_their_examples_stand_on_the_body_that_was_found(
    found: tuple[TrackerSession, PerformerCalibration, SkeletonPrior],
) -> None:
    made, bodies = setting(), []

    class Watching(MeanPose):
        def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> FittedMeanPose:
            bodies.append((body, [example.qpos for example in examples]))
            return super().fit(body, examples, rng)

    made.fit_method(Watching(), "watching")
    other = made.with_calibration(found[1])
    other.fit_method(Watching(), "watching")
    assert [body for body, _ in bodies] == [made.body, found[1].body]
    (own,), (calibrated,) = (examples for _, examples in bodies)
    reach_m = [joint_centres_m(body.skeleton, q[:1]) for (body, _), q in zip(bodies, (own, calibrated), strict=True)]
    assert np.abs(own - calibrated).max() > 1e-3
    assert np.abs(reach_m[0] - reach_m[1]).max() < 0.3


def test_the_people_whose_bones_are_learnt_from_are_not_the_performer() -> None:
    source = open_motion_source("builtin", None, seed=1, rate_hz=None)
    performers = [synthetic.performer_skeleton(name).length_m for name in synthetic.performer_names()]
    for skeleton in source.other_skeletons("p1").values():
        assert min(np.abs(skeleton.length_m - own).max() for own in performers) > 0.002


@pytest.mark.parametrize("wrong", [{"miss_deg": -1.0}, {"hold_s": 1.0}, {"beside_m": 2.0}, {"turned_deg": -5.0}])
def test_absurd_models_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(BadInput, match=next(iter(wrong))):
        CalibrationSettings(**wrong)


def test_nobody_s_own_skeleton_is_learnt_from_a_library(mocap: Path) -> None:
    scenario = load_scenario("calibration_cmu")
    source = open_motion_source("cmu", mocap, seed=1, rate_hz=120.0)
    for clip in scenario.motion.test:
        made = ClipEvaluation(scenario, source, ClipPart(clip), "walking")
        own = made.body.skeleton.length_m
        assert source.subject(clip) not in made.subject.people
        assert len(made.subject.people) == len(source.other_skeletons("")) - 1 >= 19
        assert min(np.abs(skeleton.length_m - own).max() for skeleton in made.subject.people.values()) > 0.002
        assert source.subject(clip) not in {source.subject(name) for name in scenario.motion.examples}
