"""The experiments of Kim et al. 2012: their scenarios are what they say, and claims that nothing ran for say so."""

from dataclasses import replace
from pathlib import Path

import pytest

from harness.core.package_data import data_folder
from harness.core.split import ClipPart, allowed_frames
from harness.experiment import ClipEvaluation, check_names
from harness.experiment.scenarios import load_scenario, open_scenario_motion
from harness.results import open_study
from harness.results.findings import PaperFindings, read_findings, write_findings
from harness.study.papers.kim2012 import ARM_AND_SPINE, PAPER
from harness.study.papers.paper_study import PaperStudy, run_scenarios
from harness.study.papers.station_sets import format_station_set
from harness.study.papers.tables import HINGE_GROUPS

FILES = sorted((data_folder("scenarios") / "papers" / "kim2012").glob("*.toml"))
BUILT_IN = [path for path in FILES if path.stem.startswith("builtin_")]
CMU = [path for path in FILES if path.stem.startswith("cmu_")]
DATABASE = {"boxing": 7_233, "table_tennis": 4_271, "walking": 1_317}
READ_BACK = [name for name in PAPER.experiments if name != "speed"]
"""Experiments that rest on runs alone."""
SPARSE = {"table_tennis": 31, "walking": 43}


def test_both_motions_have_runs() -> None:
    names = {path.stem.removeprefix("builtin_") for path in BUILT_IN}
    assert len(names) == 13
    assert {path.stem.removeprefix("cmu_") for path in CMU} == names


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_what_is_judged_is_never_learnt_from_and_enough(path: Path) -> None:
    scenario = load_scenario(path)
    motion = scenario.motion
    assert len(motion.test) >= (8 if "five" in path.stem else 12)  # five_trackers has no statement to decide
    assert scenario.noise == "clean"
    assert motion.body == "common"
    if motion.split == "sequence":
        assert not set(motion.test) & set(motion.examples)
    if path.stem.partition("_")[2].startswith("sensors"):
        assert (
            len({format_station_set(made.worn_stations) for _, made in scenario.variants()})
            == len(scenario.variants())
            == 31
        )


@pytest.mark.parametrize(
    "path", [path for path in BUILT_IN if "one_sparse" not in path.stem], ids=lambda path: path.stem
)
def test_built_in_databases_have_the_papers_size_and_know_the_performer(path: Path) -> None:
    """A take has 2,401 frames at 120 Hz; a run of n of them has 1 + (n - 1) // 3 at the tracker's 40."""
    motion = load_scenario(path).motion
    (behaviour,) = motion.behaviours
    withheld = [ClipPart.parse(text) for text in motion.withheld]
    runs = [run for name in motion.examples for run in allowed_frames(withheld, name, 2401, 120.0)]
    assert sum(1 + (len(run) - 1) // 3 for run in runs) == pytest.approx(DATABASE[behaviour], rel=0.01)
    sparse = path.stem.startswith(("builtin_sparse", "builtin_extrapolation"))
    assert motion.thin_to == (SPARSE[behaviour] if sparse else 0)
    subjects = [{name.split("_")[-2] for name in names} for names in (motion.test, motion.examples)]
    assert len(subjects[0]) == (8 if "five" in path.stem else 12)  # each of a test take is another unit
    assert subjects[0] == subjects[1]


@pytest.mark.parametrize("behaviour", SPARSE)
def test_one_sparse_database_keeps_the_papers_share_of_each_behaviour(behaviour: str) -> None:
    """The paper has 31 frames of table tennis and 43 of walking, 74 in all."""
    motion = load_scenario(data_folder("scenarios") / f"papers/kim2012/builtin_one_sparse_{behaviour}.toml").motion
    withheld = [ClipPart.parse(text) for text in motion.withheld]
    frames = dict.fromkeys(SPARSE, 0)
    for name in motion.examples:
        runs = allowed_frames(withheld, name, 2401, 120.0)
        frames[name.rpartition("_p")[0]] += sum(1 + (len(run) - 1) // 3 for run in runs)
    assert motion.database == "all"
    assert motion.thin_to == sum(SPARSE.values())
    kept = {name: motion.thin_to * count / sum(frames.values()) for name, count in frames.items()}
    assert kept == pytest.approx(SPARSE, abs=0.5)
    assert not set(motion.test) & set(motion.examples)


@pytest.mark.parametrize("path", CMU, ids=lambda path: path.stem)
def test_every_clip_of_real_motion_is_there(path: Path, mocap: Path) -> None:
    scenario = load_scenario(path)
    source = open_scenario_motion(scenario.motion, mocap, 1)
    parts = [ClipPart.parse(text) for text in scenario.motion.test]
    check_names([scenario], mocap)
    settings = [ClipEvaluation(scenario, source, part, scenario.motion.behaviours[0]) for part in parts]
    known = 12
    assert [setting.subject.performer for setting in settings] == ["known"] * known + ["new"] * (len(parts) - known)


def test_joint_groups_are_of_different_bones_and_all_of_them() -> None:
    for groups in (ARM_AND_SPINE, HINGE_GROUPS):
        bones = [bone for group in groups.values() for bone in group]
        assert len(bones) == len(set(bones)) == 22


def test_what_did_not_run_is_said_not_to_have_run(tmp_path: Path) -> None:
    study = PaperStudy(tmp_path, "cmu", 1, PAPER.plan("cmu", 1), tmp_path)
    for name in READ_BACK:
        experiment = PAPER.experiments[name](study)
        assert {claim.verdict for claim in experiment.claims} <= {"not run"}
        assert len(experiment.question) > 100
        assert set(experiment.runs) <= set(study.runs)
    texts = [claim.text for claim in PAPER.experiments["sparse"](study).claims]
    assert any(text.startswith("swordplay (for table tennis), 31 frames") for text in texts)
    assert not any(text.startswith("table tennis") for text in texts)


@pytest.mark.slow
def test_experiments_are_judged_from_what_ran(tmp_path: Path) -> None:
    """One short clip of each run: figures come out, and one clip tells nothing."""
    runs = {}
    for name, scenario in PAPER.plan("builtin", 1).items():
        motion = scenario.motion
        short = replace(motion, test=motion.test[:1], examples=motion.examples[:1], longest_s=2.2)
        vary = {key: values[::10] for key, values in scenario.vary.items()} if name.startswith("sensors") else None
        runs[name] = replace(scenario, motion=short, vary=scenario.vary if vary is None else vary)
    with open_study(tmp_path / "study", {"paper": "kim2012"}):
        assert run_scenarios(runs, tmp_path / "study") == {}
    study = PaperStudy(tmp_path / "study", "builtin", 1, runs)
    found = tuple(PAPER.experiments[name](study) for name in READ_BACK)
    assert {claim.verdict for experiment in found for claim in experiment.claims} <= {"cannot tell", "not run"}
    assert all(experiment.tables for experiment in found)
    assert all(experiment.runs for experiment in found)
    whole = PaperFindings("kim2012", PAPER.reference, "built-in performer", "", 1, found, {})
    write_findings(tmp_path / "findings.json", whole)
    assert read_findings(tmp_path / "findings.json") == whole
