"""Results and captures that verbs wrote, made once a session for all tests that read them.

With several workers the first one that needs a product makes it, the others wait. Reports that are no file are computed
once by each worker.
"""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from filelock import FileLock

from harness.bench.lab.captures import planted_capture
from harness.bench.lab.validated_captures import planted_truth
from harness.bench.limits import state_verdict
from harness.bench.physics import error_statistics
from harness.bench.physics.error_statistics import LIMIT_M, MERGE_S, SEGMENT_S
from harness.cli import main
from harness.errors import Outcome
from harness.experiment import prepare_playback
from harness.measure import Bar
from harness.measure.reports import UnitReport, ValidationReport
from harness.report.coverage import page as coverage
from harness.report.coverage.content import CoverageContent
from harness.report.coverage.page import coverage_page
from harness.report.kit import Page
from harness.report.physics.error_comparison import ErrorModelComparison
from harness.results.findings import PlacementFindings, TrustFindings, read_placement
from harness.stream.recording import CaptureReader, record_capture
from harness.study.placement.placement_study import run_placement
from harness.study.trust.capture_readings import read_capture
from harness.study.trust.characterization import characterize_capture
from harness.study.trust.plan import plan_digest
from harness.study.trust.trust_study import run_trust_study
from harness.study.trust.validation import validate_capture
from tests.study.trust.conftest import CLIPS, SCENARIO

Make = Callable[[str, Callable[[Path], object]], Path]
RIG = """
schema = 1
methods = ["ik"]
stations = "liu2011"
components.white.position_m = 0.0015
components.excursion.onsets_per_min = 12.0
[motion]
source = "builtin"
behaviours = ["rig"]
test = ["rig_p1_01"]
"""
"""A unit with twice the white noise and twelve times the excursions of the preset, on a rigid rig."""
TRUST_PLAN = """
kind = "trust plan"
scenario = "small.toml"
methods = ["mean_pose", "best_match", "ik:previous"]
seeds = [1]
[margins]
joint_angle_mean_deg = 2.0
mpjpe_mm = 1.0
"""
FAULTS_SEED, FAULTS_S = 1001, 30.0
"""Seed and length of captures with a fault [s]: errors of a station need 25 s of readings."""


@pytest.fixture(scope="session")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> Make:
    """Call a function with a new folder of this name, unless a worker did; the folder."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base

    def make(name: str, write: Callable[[Path], object]) -> Path:
        folder, done = shared / "products" / name, shared / f"{name}.done"
        with FileLock(shared / f"{name}.lock"):
            if not done.exists():
                folder.mkdir(parents=True)
                write(folder)
                done.touch()
        return folder

    return make


def run_verb(*words: object, code: int = 0) -> None:
    """Give a command, which must end with this code."""
    assert main([str(word) for word in words]) == code, words


@pytest.fixture(scope="session")
def rig_capture(made_once: Make) -> Path:
    """Three stations of a unit with two faults: they rest, are swept, and rest covered; the last record is cut."""

    def record(folder: Path) -> None:
        (folder / "hidden.toml").write_text(RIG, encoding="utf-8")
        path = folder / "rig.rec"
        run_verb("record", f"sim:{folder / 'hidden.toml'}", path, "--stations", "head,torso,left_hand")
        path.write_bytes(path.read_bytes()[:-7])

    return made_once("rig", record) / "rig.rec"


@pytest.fixture(scope="session")
def unit_with_faults(rig_capture: Path) -> UnitReport:
    """As `harness characterize --rigid left_hand,torso` finds it."""
    return characterize_capture(CaptureReader(rig_capture), bar=Bar(("left_hand", "torso"))).report


def _validated(made_once: Make, kind: str) -> ValidationReport:
    folder = made_once(kind, lambda to: planted_capture(kind, FAULTS_SEED, to, seconds=FAULTS_S))
    path = folder / f"{kind}_{FAULTS_SEED}.rec"
    return validate_capture(read_capture(CaptureReader(path)), planted_truth(kind, FAULTS_SEED)).report


@pytest.fixture(scope="session")
def late_capture(made_once: Make) -> ValidationReport:
    """Boxing whose stream is 20 ms late, as `harness validate` reports it."""
    return _validated(made_once, "latency")


@pytest.fixture(scope="session")
def exchanged_capture(made_once: Make) -> ValidationReport:
    """Boxing in which two stations are exchanged."""
    return _validated(made_once, "exchanged")


@pytest.fixture(scope="session")
def trust_findings(made_once: Make) -> TrustFindings:
    """What `harness trust` finds of captures whose orientations are noisier than in the plan's simulation."""

    kept: list[TrustFindings] = []

    def study(folder: Path) -> None:
        (folder / "small.toml").write_text(SCENARIO, encoding="utf-8")
        device = f"components.white.orientation_rad = 0.02{SCENARIO}"
        (folder / "device.toml").write_text(device, encoding="utf-8")
        (folder / "plan.toml").write_text(TRUST_PLAN, encoding="utf-8")
        note = {"scenario": "small", "plan": plan_digest(folder / "plan.toml"), "rate_hz": 40.0, "seed": 1}
        for clip in CLIPS:
            simulation = prepare_playback(folder / "device.toml", clip=clip).simulation
            capture = folder / f"{clip}.rec"
            record_capture(capture, simulation.wire_format, simulation.wire, {**note, "clip": clip})
        kept.append(compute(folder))

    def compute(folder: Path) -> TrustFindings:
        captures = [folder / f"{clip}.rec" for clip in CLIPS]
        return run_trust_study(folder / "plan.toml", captures, folder / "out").findings

    folder = made_once("trust", study)
    return kept[0] if kept else compute(folder)


@pytest.fixture(scope="session")
def error_models() -> ErrorModelComparison:
    """What `harness bench physics --truth` compares, on one take of 30 s, with a row of every verdict."""
    rows = (
        state_verdict("static", "1.0 to 2.0 mm", "1.54 mm", True, "1.5 mm RMS"),
        state_verdict("free motion", "excursions in 18 of 20 seeds", "14 of 20 seeds", False, "3 cm", "fewer echoes"),
        state_verdict("four speeds", "RMS rises at each step", "", None),
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(error_statistics, "_SECONDS", 30.0)
        models = error_statistics.compare_error_models([1])
    return ErrorModelComparison(models, rows, "harness bench physics --truth", LIMIT_M, MERGE_S, SEGMENT_S)


@pytest.fixture(scope="session")
def coverages(tmp_path_factory: pytest.TempPathFactory) -> tuple[CoverageContent, CoverageContent]:
    """What `harness inspect` shows of a constellation: without a clip, and with five stations that box."""
    kept: list[CoverageContent] = []

    def keep(content: CoverageContent) -> Page:
        kept.append(content)
        return coverage_page(content)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(coverage, "coverage_page", keep)
        out = tmp_path_factory.mktemp("coverage")
        run_verb("inspect", "cave.mcf", "--out", out / "plain.html")
        run_verb(
            *("inspect", "cave.mcf", "--clip", "boxing_p1_01", "--stations", "kim2012", "--out", out / "clip.html")
        )
    plain, boxing = kept
    return plain, boxing


@pytest.fixture(scope="session")
def placement_study(made_once: Make) -> Path:
    """The folder of a study in every mode of three places, of which one alone is read; seven short clips."""

    def study(folder: Path) -> None:
        from tests.study.placement.test_placement_study import ALL_MODES, SEVEN, STUDY, written

        question = STUDY.replace("metric =", "condition_size = 1\nmetric =")
        assert run_placement(written(folder, ALL_MODES, clips=SEVEN, study=question), folder / "out")[1] is Outcome.PASS

    return made_once("placement", study) / "out"


@pytest.fixture(scope="session")
def placement(placement_study: Path) -> PlacementFindings:
    return read_placement(placement_study / "findings.json")
