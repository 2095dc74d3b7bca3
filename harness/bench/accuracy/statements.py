"""Statements of the accuracy benchmark: paired intervals on pooled clips, the ranking, and clips that became worse.

Known performers are pooled over behaviours, and new ones are pooled separately. Each clip counts once, with its mean
over the seeds. Differences are tested by `compare.paired_statistics`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.bench.accuracy.clip_errors import ANGLE, SILENT_ANGLE, ErrorsByCondition
from harness.bench.accuracy.conditions import COMPARED_METHODS, LIMITING_METHODS, PRESETS, TABLE_SCENARIOS
from harness.bench.accuracy.targets import require_mean
from harness.compare.paired_statistics import PairedDifference, compare_paired
from harness.compare.ranking import MethodRanking, rank_methods

LARGEST_RATIO = 1.05
"""Largest ratio of an error to that of a limiting method on one clip."""
PERFORMERS = ("known", "new")


@dataclass(frozen=True)
class PairedStatement:
    """One method against another one on the pooled clips of one kind of performers, with one noise preset."""

    performer: str
    noise: str
    method: str
    other: str
    mean_deg: float
    """Mean error of `method` over the clips [deg]."""
    other_mean_deg: float
    difference: PairedDifference
    """Error of `other` minus that of `method` [deg]: above zero where `method` is better."""

    @property
    def verdict(self) -> str:
        """Verdict on `method`: "better", "worse" or "cannot tell"."""
        return {"reproduced": "better", "not reproduced": "worse"}.get(self.difference.verdict, "cannot tell")

    @property
    def holds(self) -> bool:
        """Whether the statement holds: better for known performers, not worse for new ones."""
        return self.verdict == "better" if self.performer == "known" else self.verdict != "worse"


@dataclass(frozen=True)
class WorseClip:
    """A clip on which the method's error exceeds that of a limiting method by more than 5 %."""

    condition: str
    clip: str
    other: str
    error_deg: float
    other_error_deg: float

    @property
    def ratio(self) -> float:
        """The error relative to that of the other method."""
        return self.error_deg / self.other_error_deg


def pool_clips(errors: ErrorsByCondition, noise: str, performer: str) -> dict[str, float]:
    """Clip -> mean joint angle error [deg], over the table scenarios with one preset and one kind of performers."""
    return {
        clip: require_mean(clip_errors, ANGLE, clip)
        for name in TABLE_SCENARIOS
        for clip, clip_errors in errors.get(f"{name}, {noise}", {}).items()
        if clip_errors.performer == performer
    }


def compare_methods(method: str, by_method: Mapping[str, ErrorsByCondition]) -> list[PairedStatement]:
    """Compare `method` with each of `COMPARED_METHODS` but itself, for every preset and kind of performers."""
    found = []
    for performer in PERFORMERS:
        for noise in PRESETS:
            ours = pool_clips(by_method[method], noise, performer)
            for other in COMPARED_METHODS:
                theirs = pool_clips(by_method.get(other, {}), noise, performer)
                difference = compare_paired(theirs, ours)
                if other == method or not difference.units:
                    continue
                error, other_error = (float(np.mean([of[clip] for clip in difference.units])) for of in (ours, theirs))
                found.append(PairedStatement(performer, noise, method, other, error, other_error, difference))
    return found


def rank_pooled(by_method: Mapping[str, ErrorsByCondition]) -> dict[tuple[str, str], MethodRanking]:
    """The ranking of all methods by (kind of performers, preset), without those that have no clip."""
    found: dict[tuple[str, str], MethodRanking] = {}
    for performer in PERFORMERS:
        for noise in PRESETS:
            values = {name: {ANGLE: pool_clips(errors, noise, performer)} for name, errors in by_method.items()}
            if ranking := rank_methods(values, ANGLE):
                found[performer, noise] = ranking
    return found


def find_worse_clips(
    method: str, by_method: Mapping[str, ErrorsByCondition], stored_title: str, stored: ErrorsByCondition
) -> list[WorseClip]:
    """Clips on which `method` exceeds the stored errors, or those of `LIMITING_METHODS`, by more than 5 %.

    All conditions count; where a station is silent, the errors meanwhile. The clips with the largest ratios come first.
    """
    others = {stored_title: stored} | {name: by_method[name] for name in LIMITING_METHODS}
    found = []
    for condition, by_clip in by_method[method].items():
        for clip, errors in by_clip.items():
            metric = SILENT_ANGLE if SILENT_ANGLE in errors.by_metric else ANGLE
            ours = require_mean(errors, metric, clip)
            for other, other_errors in others.items():
                theirs = other_errors.get(condition, {}).get(clip)
                worse = theirs and WorseClip(condition, clip, other, ours, require_mean(theirs, metric, clip))
                if worse and worse.ratio > LARGEST_RATIO:
                    found.append(worse)
    return sorted(found, key=lambda worse: -worse.ratio)
