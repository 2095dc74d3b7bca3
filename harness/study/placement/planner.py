"""What a placement study is planned from: the TOML file of a study, or a question with a budget of time."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Protocol

from harness.experiment.scenarios import Scenario
from harness.mocap import LibraryFolders
from harness.study.placement.config import PlacementStudy
from harness.study.placement.plan import PlacementPlan, plan_placement, plan_study
from harness.study.placement.question import PlacementQuestion, plan_within_budget, question_study


class Planner(Protocol):
    """Plans a study, and plans it again once it is known how long a cell takes."""

    def first_plan(self) -> PlacementPlan:
        """The plan with everything that may be measured."""

    def final_plan(self, cell_s: float) -> tuple[PlacementPlan, tuple[str, ...]]:
        """The plan that is carried out, and notes on it; `cell_s` is the duration of a cell on one worker [s]."""


@dataclass(frozen=True)
class FilePlanner:
    """Plans the study of a TOML file, or a shipped one by name, as the file says."""

    path: Path | str
    folder: LibraryFolders | None

    @cached_property
    def _plan(self) -> PlacementPlan:
        return plan_placement(self.path, self.folder)

    def first_plan(self) -> PlacementPlan:
        return self._plan

    def final_plan(self, cell_s: float) -> tuple[PlacementPlan, tuple[str, ...]]:
        return self._plan, ()


@dataclass(frozen=True)
class QuestionPlanner:
    """Plans the study that answers a question, within the question's budget of time on `jobs` workers."""

    question: PlacementQuestion
    folder: LibraryFolders | None
    jobs: int

    @cached_property
    def _study(self) -> tuple[PlacementStudy, Scenario]:
        return question_study(self.question, self.folder)

    def first_plan(self) -> PlacementPlan:
        study, scenario = self._study
        return plan_study(study, lambda name: scenario, self.folder)

    def final_plan(self, cell_s: float) -> tuple[PlacementPlan, tuple[str, ...]]:
        study, scenario, note = plan_within_budget(*self._study, self.question, cell_s, self.jobs)
        return plan_study(study, lambda name: scenario, self.folder), (note,)
