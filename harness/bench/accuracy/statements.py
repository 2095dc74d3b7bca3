"""Statements of the accuracy benchmark: paired intervals on pooled clips, the ranking, and clips that became worse.

Known performers are pooled over behaviours, and new ones are pooled separately. Each clip counts once, with its mean
over the seeds. Differences are tested by `compare.paired_statistics`.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from harness.bench.accuracy.clip_errors import ANGLE, SILENT_ANGLE, ErrorsByCondition
from harness.bench.accuracy.conditions import COMPARED_METHODS, LIMITING_METHODS, PRESETS, TABLE_SCENARIOS
from harness.bench.accuracy.targets import require_mean
from harness.bench.limits import state_verdict
from harness.compare import MethodRanking, compare_paired, rank_methods
from harness.results.findings import BenchmarkStatement

LARGEST_RATIO = 1.05
"""Largest ratio of an error to that of a limiting method on one clip."""
PERFORMERS = ("known", "new")


def pool_clips(errors: ErrorsByCondition, noise: str, performer: str) -> dict[str, float]:
    """Clip -> mean joint angle error [deg], over the table scenarios with one preset and one kind of performers."""
    return {
        clip: require_mean(clip_errors, ANGLE, clip)
        for name in TABLE_SCENARIOS
        for clip, clip_errors in errors.get(f"{name}, {noise}", {}).items()
        if clip_errors.performer == performer
    }


def compare_methods(method: str, by_method: Mapping[str, ErrorsByCondition]) -> list[BenchmarkStatement]:
    """Compare `method` with each of `COMPARED_METHODS` but itself, for every preset and kind of performers.

    It must be better for known performers, and not worse for new ones. Positive differences are in its favour.
    """
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
                is_better, is_worse = (difference.verdict == word for word in ("reproduced", "not reproduced"))
                found.append(
                    state_verdict(
                        f"{performer} performers, {noise}: {method} against {other}",
                        "better" if performer == "known" else "not worse",
                        f"{error:.2f} against {other_error:.2f} deg",
                        None if difference.low is None else is_better if performer == "known" else not is_worse,
                        why=difference.why if difference.low is None else "",
                        clips=len(difference.units),
                        value=difference.mean,
                        low=difference.low,
                        high=difference.high,
                        unit="deg",
                        more={"performers": performer, "noise": noise, "other": other},
                    )
                )
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
) -> list[BenchmarkStatement]:
    """Clips on which `method` exceeds the stored errors, or those of `LIMITING_METHODS`, by more than 5 %.

    All conditions count; where a station is silent, the errors meanwhile. There is a statement for each such clip, the
    largest ratio first, and one for all where there is none.
    """
    others = {stored_title: stored} | {name: by_method[name] for name in LIMITING_METHODS}
    found: list[BenchmarkStatement] = []
    target = f"<= {LARGEST_RATIO:g}"
    for condition, by_clip in by_method[method].items():
        for clip, errors in by_clip.items():
            metric = SILENT_ANGLE if SILENT_ANGLE in errors.by_metric else ANGLE
            ours = require_mean(errors, metric, clip)
            for other, other_errors in others.items():
                if clip in (limits := other_errors.get(condition, {})):
                    theirs = require_mean(limits[clip], metric, clip)
                    found.append(
                        state_verdict(
                            f"{condition}, {clip}: {method} / {other}",
                            target,
                            f"{ours / theirs:.3f}",
                            ours / theirs <= LARGEST_RATIO,
                            f"{ours:.2f} and {theirs:.2f} deg",
                            value=ours / theirs,
                            more={"condition": condition, "clip": clip, "other": other},
                        )
                    )
    if worse := [statement for statement in found if statement.verdict == "missed"]:
        return sorted(worse, key=lambda statement: -(statement.value or 0.0))
    largest = max(found, key=lambda statement: statement.value or 0.0)
    name = f"{method} / {', '.join(others)}: the largest ratio on a clip"
    return [replace(largest, text=name, reference=f"{largest.text}: {largest.reference}")]
