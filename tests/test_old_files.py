"""Files that earlier versions wrote are still read, and have the values that they had (`tests/old_files/README.md`)."""

import csv
import json
import shutil
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import harness
from harness.calibrate import read_calibration
from harness.cli import main
from harness.compare import compare_runs
from harness.errors import BadFile, Outcome
from harness.experiment.scenarios import read_fitted_unit
from harness.measure import read_unit_file
from harness.results import load_results, open_study
from harness.results.findings import read_findings, read_placement
from harness.simulate.physics import read_mcf
from harness.stream.recording import RecordingStream, open_poses, read_recording
from harness.study.trust.plan import plan_digest
from harness.study.trust.trust_study import run_trust_study
from tests.command import Command
from tests.verb_examples import unpack_files

PLAN_DIGEST = "269190c444c3be8bc1188b42a66241bbcbd133ec0ded2d66d79586bcfb948b14"
STATIONS = ("left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head")
ERRORS_MM = {
    ("mean_pose", "walking_p1_01"): 224.66271,
    ("ik:previous", "walking_p1_01"): 35.25919,
    ("mean_pose", "boxing_p1_01"): 189.82738,
    ("ik:previous", "boxing_p1_01"): 31.76145,
}
"""Method and clip of `run` -> mpjpe_mm."""


@pytest.fixture
def old(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files, which is also the working folder."""
    unpack_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", ["run", "baseline"])
def test_a_run_and_its_baseline(old: Path, name: str) -> None:
    results = load_results(name)
    assert results.planned == 4
    errors = {(cell.method, cell.clip): cell.metrics["mpjpe_mm"] for cell in results.cells}
    assert errors == {key: pytest.approx(value, abs=1e-4) for key, value in ERRORS_MM.items()}


def test_the_frames_of_a_run(old: Path) -> None:
    cells = {cell.clip: cell for cell in harness.load("run").cells(method="ik:previous")}
    assert cells["walking_p1_01"].errors["joint_angle_mean_deg"][-1] == pytest.approx(11.0006, abs=1e-3)
    assert cells["boxing_p1_01"].errors["joint_angle_mean_deg"][-1] == pytest.approx(5.34125, abs=1e-4)
    assert main(["status", "run"]) == Outcome.PASS.exit_code


def test_a_run_is_printed_and_compared_as_it_was(old: Path, command: Command) -> None:
    baselines = old / "results" / "baselines"
    baselines.mkdir(parents=True)
    shutil.copytree("baseline", baselines / "old_run")
    command("compare", "old_run", "run")
    printed = list(csv.DictReader(command("table", "run", "--format", "csv").lines))
    with open("table.csv", encoding="utf-8", newline="") as file:
        stored = list(csv.DictReader(file))
    assert (
        [row["mpjpe_mm"] for row in printed[:2]] == [row["mpjpe_mm"] for row in stored] == ["207.245047", "33.5103204"]
    )


@pytest.mark.long
def test_a_run_is_comparable_with_one_of_today_and_resumed(old: Path) -> None:
    """A key that a later version adds to scenarios makes no stored result incomparable."""
    assert main(["run", "shorter.toml", "--out", "today", "--no-report"]) == Outcome.PASS.exit_code
    comparison = compare_runs("run", "today")
    assert (comparison.matched, list(comparison.inputs_that_differ)) == (4, [])
    assert main(["run", "shorter.toml", "--out", "run", "--no-report"]) == Outcome.PASS.exit_code
    errors = {(cell.method, cell.clip): cell.metrics["mpjpe_mm"] for cell in load_results("run").cells}
    assert errors == {key: pytest.approx(value, rel=0.02) for key, value in ERRORS_MM.items()}


def test_a_sweep(old: Path) -> None:
    errors = {cell.noise: cell.metrics["mpjpe_mm"] for cell in load_results("sweep").cells}
    assert errors == {"clean": pytest.approx(220.56514, abs=1e-4), "noise": pytest.approx(220.15255, abs=1e-4)}
    assert main(["status", "sweep"]) == Outcome.PASS.exit_code


def test_recordings(old: Path) -> None:
    for name, frames, place_m in [
        ("walking", 30, (-2.04762314, 1.68845337, 1.65344711)),
        ("boxing", 30, (-0.2999794, -0.63108067, 1.1193663)),
        ("line", 21, (-0.08343644, -0.92522194, 1.08662971)),
        ("marks", 60, (-0.01406736, -0.76933296, 1.08865334)),
    ]:
        found = list(RecordingStream(f"{name}.rec"))
        assert len(found) == frames
        np.testing.assert_allclose(found[-1].position_m[0], place_m, atol=1e-7)
        assert read_recording(f"{name}.rec").damage == ()
    assert read_recording("marks.rec").marks == [{"monotonic_s": 0.0, "stretch": "static"}]
    assert read_recording("line.rec").events[0]["text"] == "records arrive: 2 stations at 20 Hz"
    status, emitters = (answer["answers"] for answer in read_recording("commands.rec").answers)
    assert status[0]["firmware"] == "4.2301"
    assert len(emitters) == 9


def test_the_plan_of_recordings(old: Path) -> None:
    """The digest of a plan is the same today, so that captures which carry it are still of that plan."""
    assert plan_digest(Path("plan.toml")) == PLAN_DIGEST
    assert [read_recording(f"{name}.rec").note["plan"] for name in ("walking", "boxing")] == [PLAN_DIGEST] * 2


@pytest.mark.long
def test_a_trust_study_goes_on(old: Path) -> None:
    """The folder is that of the same study. Cells of other code are computed again."""
    stored = json.loads(Path("trust/findings.json").read_text(encoding="utf-8"))
    assert (stored["outcome"], stored["plan_digest"]) == ("not comparable", PLAN_DIGEST)
    findings = run_trust_study(Path("plan.toml"), [Path("walking.rec"), Path("boxing.rec")], Path("trust")).findings
    assert findings.outcome is Outcome.NOT_COMPARABLE
    assert [row.device for row in findings.equivalences] == [
        pytest.approx(row["device"], rel=0.02) for row in stored["equivalences"]
    ]


@pytest.mark.parametrize(("name", "hand_m"), [("poses", -6.788698857816287e-05), ("tpose", -0.00015897)])
def test_calibrations(old: Path, name: str, hand_m: float) -> None:
    found = read_calibration(f"{name}.toml")
    assert (found.calibration.kind, found.calibration.stations) == (name, STATIONS)
    assert found.calibration.mount_m[0, 0] == pytest.approx(hand_m, rel=1e-4)
    assert found.skeleton is not None
    assert found.skeleton.bone_m[13, 1] == pytest.approx({"poses": -0.19072472, "tpose": -0.1882}[name], abs=1e-8)


def test_unit_files(old: Path) -> None:
    unit = read_unit_file("unit.toml")
    assert (unit.name, unit.components["white"]["position_m"]) == ("rig", 0.0007555863609075295)
    assert unit.measured["components.clock.drift_ppm"].count == 60
    assert read_fitted_unit(Path("unit.toml")).components["excursion"]["onsets_per_min"] == 6.808943089430894
    validated = read_unit_file("validated.toml")
    assert validated.session["scale"].value == -0.00014803744610268903


@pytest.mark.long
@pytest.mark.parametrize("name", ["poses", "tpose", "unit", "validated"])
def test_no_lost_line_and_no_cut_of_a_file_without_a_digest_gives_other_values(old: Path, name: str) -> None:
    path = Path(f"{name}.toml")

    def values() -> str:
        if name in ("unit", "validated"):
            unit = read_fitted_unit(path)
            return repr((unit.components, unit.tracker))
        found = read_calibration(path)
        arrays = ("mount_m", "bone_from_station", "world_from_tracker", "tracker_origin_m")
        bone_m = None if found.skeleton is None else found.skeleton.bone_m.tolist()
        numbers = [getattr(found.calibration, array).tolist() for array in arrays]
        return repr((found.calibration.kind, found.calibration.stations, found.calibration.bones, numbers, bone_m))

    lines, whole = path.read_bytes().splitlines(keepends=True), values()
    for n in range(len(lines)):
        for rest in (lines[:n] + lines[n + 1 :], lines[:n]):
            path.write_bytes(b"".join(rest))
            with suppress(BadFile):
                assert values() == whole, f"line {n + 1}"


def test_a_constellation(old: Path) -> None:
    emitters = read_mcf(Path("constellation.mcf"))
    assert [emitter.number for emitter in emitters] == list(range(1, len(emitters) + 1))
    assert len(emitters) == 9


def test_a_paper(old: Path) -> None:
    assert read_findings(Path("paper/findings.json")).experiments[0].claims[0].value == -1.114648837550544
    errors = {cell.method: cell.metrics["mpjpe_mm"] for cell in load_results("paper/bouts").cells}
    assert errors == {
        "mean_pose": pytest.approx(94.265458, abs=1e-5),
        "ik:previous": pytest.approx(13.702175, abs=1e-5),
    }
    with open_study(old / "paper", {"paper": "tiny", "motion": "built-in performer", "seed": 1}):
        pass


def test_a_placement_study(old: Path) -> None:
    findings = read_placement(Path("placement/findings.json"))
    best = findings.best[0]
    assert (best.stations, best.ties, best.selection_stability) == (("pelvis",), (("hand",),), 1.0)
    assert findings.contributions  # its key was called worth
    assert main(["status", "placement"]) == Outcome.PASS.exit_code


def test_no_file_is_left_out(old: Path) -> None:
    """Every file of the archive is one that a test above reads, or a scenario."""
    files = {path.relative_to(old).parts[0] for path in old.rglob("*") if path.is_file()}
    scenarios = {"small.toml", "shorter.toml", "sweep.toml", "walk.toml", "place.toml", "plan.toml", "rig.toml"}
    assert files - scenarios == {
        *("run", "sweep", "baseline", "paper", "placement", "trust"),
        *("walking.rec", "boxing.rec", "line.rec", "commands.rec", "marks.rec", "constellation.mcf"),
        *("poses.toml", "tpose.toml", "unit.toml", "validated.toml", "table.csv", "table.md", "table.tex"),
    }


def test_recordings_of_poses_and_of_a_fastrak(tmp_path: Path) -> None:
    unpack_files(tmp_path, "759b847b")
    assert {path.name for path in tmp_path.iterdir()} == {"poses.rec", "vrpn.rec", "fastrak.rec"}
    found = open_poses([tmp_path / "poses.rec"])
    assert (found.plan, found.marks, found.damage) == (PLAN_DIGEST, ((0.0, "static"), (0.4, "slow")), ())
    assert {body.name: len(body.times_s) for body in found.log.bodies} == {"left": 40, "right": 38}
    np.testing.assert_allclose(found.log.bodies[0].positions_m[-1], (-0.37018, 0.18579, 1.239), atol=1e-12)
    np.testing.assert_allclose(found.log.bodies[1].quaternions[-1], (0.99615354, 0.0, 0.0, 0.08762496), atol=1e-8)
    assert "length unit: mm (coordinates reach 1237 and speeds 2421 a second)" in map(str, found.log.findings)
    served = open_poses([tmp_path / "vrpn.rec"]).log
    assert (served.names, served.start_unix_s) == (("left_hand", "right_hand"), 1795834013.64178)
    np.testing.assert_allclose(served.bodies[0].positions_m[-1], (-0.08946259, -0.92344383, 1.10771957), atol=1e-8)
    stream = RecordingStream(tmp_path / "fastrak.rec")
    frames = list(stream)
    assert (stream.wire.family, len(frames), stream.recording.damage) == ("fastrak", 60, ())
    np.testing.assert_allclose(frames[-1].position_m[0], (-0.23651972, -0.51670048, 1.12104897), atol=1e-8)
