"""A paper of two short runs for tests; `python -m tests.study.papers.tiny --out DIR` runs the verb `paper` with it."""

import sys
from dataclasses import dataclass, replace
from typing import Literal

from harness.__main__ import main
from harness.experiment.scenarios import Scenario, ScenarioMotion, load_scenario
from harness.results.findings import PaperExperiment
from harness.study.papers import paper as papers
from harness.study.papers.claims import claim_lower_error
from harness.study.papers.paper import Paper
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.tables import error_lines, errors_by_joint_group, errors_by_unit, mean_bars, mean_table

WALKS = Scenario(
    name="walks",
    motion=ScenarioMotion(
        "builtin",
        ("walking_p1_01", "walking_p2_01"),
        ("walking",),
        ("walking_p1_02", "walking_p2_02"),
        body="common",
        longest_s=2.0,
    ),
    stations=load_scenario("demo").stations,
    methods=("mean_pose", "ik:previous"),
    noise="clean",
    left_out={"walking_p3_01": "two clips are enough"},
)
BOUTS = replace(
    WALKS,
    name="bouts",
    motion=replace(WALKS.motion, test=("boxing_p1_01",), behaviours=("boxing",), examples=("boxing_p2_01",)),
)


def walks(study: PaperStudy) -> PaperExperiment:
    errors = {method: errors_by_unit(study.rows("walks", method=method)) for method in WALKS.methods}
    cells = {cell.method: cell for _, cell in study.cells("walks", clip="walking_p1_01")}
    groups = {method: errors_by_joint_group(study.cells("walks", method=method)) for method in WALKS.methods}
    kept = study.cached_measurement("count", lambda: len(list((study.out / "walks" / "cells").iterdir())))
    return PaperExperiment(
        name="walks",
        title="Two walks",
        question="Which is less?",
        differences=("It is no paper's.",),
        claims=(claim_lower_error("mean_pose errs less", errors["mean_pose"], errors["ik:previous"]),),
        tables=(mean_table("Errors", "walks", {"all": errors}), mean_table("Joints", "method", groups)),
        figures=(mean_bars("Errors", "deg", {"all": errors}), error_lines("First walk", cells)),
        runs=("walks",),
        notes=(f"{kept} cells",),
    )


def bouts(study: PaperStudy) -> PaperExperiment:
    errors = {method: errors_by_unit(study.rows("bouts", method=method)) for method in ("mean_pose", "ik:previous")}
    claim = claim_lower_error("mean_pose errs less", errors["mean_pose"], errors["ik:previous"])
    return PaperExperiment("bouts", "A bout", "Which is less?", (), claims=(claim,), runs=("bouts",))


@dataclass(frozen=True)
class Tiny(Paper):
    """Its runs stand here, not in files."""

    runs: tuple[Scenario, ...] = (WALKS, BOUTS)

    def plan(self, motion: Literal["builtin", "cmu"], seed: int) -> dict[str, Scenario]:
        return {scenario.name: replace(scenario, seed=seed) for scenario in self.runs}


TINY = Tiny("tiny", "Nobody: Nothing, 1900", {"walks": walks, "bouts": bouts})

if __name__ == "__main__":
    papers.load_paper = lambda name: TINY
    sys.argv[1:1] = ["paper", "liu2011", "--jobs", "1"]
    sys.exit(main())
