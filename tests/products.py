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
from harness.cli import main
from harness.measure.unit_report import UnitReport
from harness.measure.validation_report import ValidationReport
from harness.study.trust.characterization import characterize_capture
from harness.study.trust.validation import validate_capture

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


def run_verb(*words: object) -> None:
    """Give a command, which must not fail."""
    assert main([str(word) for word in words]) == 0, words


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
    return characterize_capture(rig_capture, rigid=("left_hand", "torso")).report


def _validated(made_once: Make, kind: str) -> ValidationReport:
    folder = made_once(kind, lambda to: planted_capture(kind, FAULTS_SEED, to, seconds=FAULTS_S))
    path = folder / f"{kind}_{FAULTS_SEED}.rec"
    return validate_capture(path, planted_truth(kind, FAULTS_SEED)).report(path)


@pytest.fixture(scope="session")
def late_capture(made_once: Make) -> ValidationReport:
    """Boxing whose stream is 20 ms late, as `harness validate` reports it."""
    return _validated(made_once, "latency")


@pytest.fixture(scope="session")
def exchanged_capture(made_once: Make) -> ValidationReport:
    """Boxing in which two stations are exchanged."""
    return _validated(made_once, "exchanged")
