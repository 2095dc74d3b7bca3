"""How a method is evaluated: it is trained, runs over the frames of an observed take, and is scored against the truth.

Runs, replayed recordings, validated captures and trust studies differ in their takes alone (`observed_take`).
"""

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from harness.core.estimate import name_with_lag
from harness.core.progress import ProgressCallback
from harness.errors import BadInput, RenamedKey, UnknownName
from harness.experiment.clip_evaluation import ClipEvaluation
from harness.experiment.methods.isolation import DEFAULT_ISOLATION
from harness.experiment.methods.method_process import MethodFailure
from harness.experiment.methods.method_run import NO_ANSWERS, MethodAnswers, describe_failure
from harness.experiment.methods.remote_method import resolve_method, run_over_frames
from harness.experiment.observed_take import ObservedTake
from harness.reconstruct import Method
from harness.score import FRAME_METRICS, LoopScores, score_loops, score_sigma, step_times_ms


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What a method answered to an observed take, and how far that is from the truth."""

    method: str
    take: ObservedTake
    answers: MethodAnswers
    """The answers by frame; those of a method that failed are empty."""
    lag: int = 0
    """Number of later frames that the method uses for each estimate."""
    seconds: float = 0.0
    """Wall time of training and of all steps [s]."""
    names: tuple[str, ...] = tuple(FRAME_METRICS)
    """The errors that are computed, of `FRAME_METRICS`."""
    failure: str = ""
    """Why the method has no answers, as for a failed cell; "" if it has them."""

    @property
    def title(self) -> str:
        """Name in tables, with the lag."""
        return name_with_lag(self.method, self.lag)

    @cached_property
    def scores(self) -> LoopScores:
        """The errors of each frame, over all loops of the take."""
        take, skeleton = self.take, self.take.clip.performer_calibration.body.skeleton
        return score_loops(
            take.truth,
            take.rate_hz,
            self.answers.qpos,
            take.loops,
            metrics=self.names,
            estimate_skeleton=skeleton,
        )

    @property
    def is_measured(self) -> bool:
        """Whether errors count: there are enough estimates and enough records."""
        return self.scores.is_enough() and self.take.has_records

    @cached_property
    def metrics(self) -> dict[str, float | None]:
        """Errors and times of the steps over all loops, by the names of `Scores.metrics`; None is "not measured"."""
        values = self.scores.pooled() | step_times_ms(self.answers.step_ms[1:])
        return {name: value if self.is_measured and np.isfinite(value) else None for name, value in values.items()}

    @property
    def sigma_scores(self) -> dict[str, float]:
        """Scores of the standard deviations over all loops (see `score.uncertainty`); empty without them."""
        found, sigma_rad = self.scores, self.answers.angle_sigma_rad
        if sigma_rad is None or not self.is_measured:
            return {}
        rows, index = found.rows[found.scored], found.index[found.scored]
        return score_sigma(self.take.truth_qpos[index], self.answers.qpos[rows], sigma_rad[rows]).scores()

    def as_dict(self) -> dict[str, Any]:
        """Content for JSON."""
        return {
            "method": self.method,
            "frames_matched": self.scores.matched,
            "frames_expected": self.scores.expected,
            "records_arrived": self.take.records_arrived,
            "records_expected": self.take.records_expected,
            "metrics": self.metrics,
            "lag": self.lag,
            "sigma_scores": self.sigma_scores,
            "failure": self.failure,
        }


def evaluate(
    method: Method,
    name: str,
    take: ObservedTake,
    *,
    stations: Sequence[str] = (),
    learnt_from: ClipEvaluation | None = None,
    metrics: Sequence[str] = tuple(FRAME_METRICS),
) -> Evaluation:
    """Train the method of that name, once, and run it over a take, in its process if it has one.

    It sees the frames of these `stations`, by default of all, and learns from what the take's clip allows, or from
    `learnt_from`. Whatever the method raises is raised.
    """
    stations = stations or take.calibration.stations
    frames, calibration = take.copy_frames(stations), take.calibration.of_stations(stations)
    start = time.perf_counter()
    fitted = (learnt_from or take.clip).fit_method(method, name)
    answers, lag = run_over_frames(fitted, calibration, frames).by_frame()
    return Evaluation(name, take, answers, lag, time.perf_counter() - start, tuple(metrics))


def evaluate_each(
    names: Sequence[str],
    take: ObservedTake,
    *,
    metrics: Sequence[str] = tuple(FRAME_METRICS),
    progress: ProgressCallback = lambda step, done, planned: None,
) -> list[Evaluation]:
    """Evaluate methods by name on one take. A method that fails has its `failure`, and stops no other.

    Names and options that do not exist are refused: UnknownName, RenamedKey and BadInput.
    """
    found = []
    for done, name in enumerate(names):
        progress(f"reconstructing with {name}", done, len(names))
        try:
            found.append(evaluate(resolve_method(name, DEFAULT_ISOLATION), name, take, metrics=metrics))
        except (UnknownName, RenamedKey, BadInput):
            raise
        except (Exception, SystemExit) as error:  # a method may raise anything: it fails alone
            failure = describe_failure(error)
            found.append(Evaluation(name, take, NO_ANSWERS, names=tuple(metrics), failure=failure))
    return found


def check_methods(names: Sequence[str]) -> None:
    """Refuse names and options of methods that do not exist: UnknownName, RenamedKey and BadInput."""
    for name in names:
        with suppress(MethodFailure):  # it fails when it is evaluated, alone
            resolve_method(name, DEFAULT_ISOLATION)
