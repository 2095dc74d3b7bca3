"""Values that no metric can have: negative or infinite errors, shares above 1, counts that contradict each other.

They are refused wherever stored results are read, also where the digest of the file fits.
"""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.score.metrics import DEFINITIONS, Definition
from harness.score.uncertainty import SIGMA_DEFINITIONS

SIGNED_METRICS = ("lag_ms", "sigma_log_score")
"""Metrics that may be negative."""
_LARGEST = {"share": 1.0, "deg": 360.0}
"""Unit -> the largest possible value; components of two axis-angle vectors differ by up to 360 deg."""
_ROUNDING = 1.0 + 1e-6
"""Per-frame errors are stored as float32."""


def find_impossible_metric(metrics: Mapping[str, Any]) -> str:
    """Describe the first metric with an impossible value, such as "mpjpe_mm is -1.0"; "" when there is none.

    None is "not measured" and always possible.
    """
    for name, value in metrics.items():
        if name in DEFINITIONS and value is not None and not _is_possible(name, value, DEFINITIONS[name]):
            return f"{name} is {str(value)[:40]}"
    matched, expected = (metrics.get(name) for name in ("frames_matched", "frames_expected"))
    if matched is not None and expected is not None and matched > expected:
        return f"frames_matched is {matched} of frames_expected {expected}"
    return ""


def find_impossible_sigma(scores: Any) -> str:
    """Describe the first impossible score of standard deviations, or one that is missing; "" when there is none.

    A method that states no standard deviations has no scores.
    """
    if not isinstance(scores, Mapping):
        return f"sigma_scores is {str(scores)[:40]}"
    for name, definition in SIGMA_DEFINITIONS.items() if scores else ():
        if not _is_possible(name, scores.get(name), definition):
            return f"{name} is {str(scores.get(name))[:40]}"
    return ""


def find_impossible_statistic(groups: Iterable[Mapping[str, Any]]) -> str:
    """Describe the first impossible mean, standard deviation or frame-weighted mean of groups in a summary."""
    for group in groups:
        if found := find_impossible_sigma(group.get("sigma_scores", {})):
            return f"the pooled {found}"
        for name, statistics in group["metrics"].items():
            for key in ("mean", "frame_weighted"):
                if found := find_impossible_metric({name: statistics.get(key)}):
                    return f"the {key} of {found}"
            sd = statistics.get("sd")
            if sd is not None and not (_is_number(sd) and sd >= 0.0):
                return f"the sd of {name} is {str(sd)[:40]}"
    return ""


def find_impossible_errors(per_frame: Mapping[str, Floats]) -> str:
    """Describe the first metric with an impossible value in some frame; NaN is "undefined" and possible."""
    for name, values in per_frame.items():
        largest = _LARGEST.get(DEFINITIONS[name].unit, np.inf) * _ROUNDING
        wrong = values[np.isinf(values) | (values < 0.0) | (values > largest)]
        if len(wrong):
            return f"{name} is {wrong[0]:g} in a frame"
    return ""


def _is_possible(name: str, value: Any, definition: Definition) -> bool:
    if not _is_number(value):
        return False
    unit = definition.unit
    if unit == "frames" and value != int(value):
        return False
    return (value >= 0.0 or name in SIGNED_METRICS) and value <= _LARGEST.get(unit, math.inf) * _ROUNDING


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
