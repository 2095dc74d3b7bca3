"""Types and values that stored cells and summaries may have, checked before other code relies on them.

A metric has no negative or infinite error, no share above 1, and no counts that contradict each other. Impossible
values are refused wherever stored results are read, also where the digest of the file fits.
"""

import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.core.fields import check_entries
from harness.core.split import StatisticalUnit
from harness.errors import BadFile, HarnessError, UnknownName
from harness.score import DEFINITIONS, SIGMA_DEFINITIONS, Definition

_Table = dict[str, Any]
_Number = float | None
_Vectors = tuple[tuple[float, float, float], ...]
_METRICS: Mapping[str, Any] = dict.fromkeys(DEFINITIONS, _Number)
_IDENTITY: Mapping[str, Any] = {
    **dict.fromkeys(("method", "behaviour", "clip", "motion_source", "mount", "inputs", "split", "calibration"), str),
    **dict.fromkeys(("noise", "scenario", "performer", "key", "source_hash"), str),
    "stations": tuple[str, ...],
    "rate_hz": float,
    "seed": int,
    "varied": _Table,
    "health": dict[str, _Number],
    "calibration_errors": dict[str, _Number],
}
_CELL: Mapping[str, Any] = {
    **_IDENTITY,
    "defined_by": _Table,
    "metrics": dict[str, _Number],
    **dict.fromkeys(("bone_m", "estimate_bone_m"), _Vectors),
    "reproduce": str,
    "notes": tuple[str, ...],
}
_BONES = ("bone_m", "estimate_bone_m")
MAX_BONE_M = 10.0
"""Longer bones are damage [choice]."""
_DISTURBANCE: Mapping[str, Any] = {"kind": str, "begins_s": float, "ends_s": float}
_STATISTIC: Mapping[str, Any] = {"mean": _Number, "sd": _Number}
_GROUP: Mapping[str, Any] = {
    **dict.fromkeys(("method", "inputs", "split", "performer"), str),
    **dict.fromkeys(("sequences", "frames_matched", "frames_expected"), int),
    "varied": _Table,
    "metrics": dict[str, _Table],
}
_GROUP_METRICS: Mapping[str, Any] = {
    name: _Table for name, metric in DEFINITIONS.items() if metric.unit != "frames" and name != "coverage"
}
_RECOVERY: Mapping[str, Any] = {
    **dict.fromkeys(("method", "inputs", "split", "behaviour", "clip", "disturbance"), str),
    **dict.fromkeys(("disturbed_deg", "undisturbed_deg", "during", "ratio", "back_after_s", "status_right"), _Number),
    "evaluated_frames": int,
}
_ORDER: Mapping[str, Any] = {
    **dict.fromkeys(("source", "method", "behaviour", "inputs", "performer"), str),
    **dict.fromkeys(("clips", "clips_of_any"), int),
    "names": tuple[str, ...],
    "varied": _Table,
    "means_deg": tuple[float, ...] | None,
    "holds": bool | None,
    "why": tuple[str, ...],
}
_SUMMARY: Mapping[str, Any] = {
    "outcome": str,
    "cells_finished": int,
    "cells_planned": int,
    "failures": dict[str, str],
    **dict.fromkeys(("methods", "behaviours", "cells"), tuple[_Table, ...]),
}
SIGNED_METRICS = ("lag_ms", "sigma_log_score")
"""Metrics that may be negative."""
_LARGEST = {"share": 1.0, "deg": 360.0}
"""Unit -> the largest possible value; components of two axis-angle vectors differ by up to 360 deg."""
_ROUNDING = 1.0 + 1e-6
"""Per-frame errors are stored as float32."""


def check_cell_types(path: Path, content: Mapping[str, Any], advice: str) -> None:
    """BadFile unless the entries of a cell.json have their types."""
    if fault := find_cell_fault(content):
        raise BadFile(path, fault, "a cell of this version of the harness", advice)


def find_cell_fault(content: Mapping[str, Any]) -> str:
    """What the content of a cell.json cannot be, such as a bone of more than 10 m; "" if nothing is."""
    try:
        check_entries(content, _CELL, "cell")
        if any(abs(value) > MAX_BONE_M for name in _BONES for vector in content[name] for value in vector):
            return f"cell: a bone of more than {MAX_BONE_M:g} m"
        _check_lag(content["defined_by"].get("lag", 0), "defined_by.lag")
        if "disturbance" in content["defined_by"]:
            check_entries(content["defined_by"]["disturbance"], _DISTURBANCE, "defined_by.disturbance")
    except (TypeError, HarnessError) as error:
        return str(error)
    return ""


def _check_lag(value: Any, where: str) -> None:
    if type(value) is not int or value < 0:
        raise TypeError(f"{where}: expected a number of frames, found {str(value)[:40]}")


def check_summary_types(path: Path, content: Mapping[str, Any], advice: str) -> None:
    """BadFile unless the entries of the summary.json of a run have their types."""
    try:
        check_entries(content, _SUMMARY, "summary")
        if content.get("performers") is not None:  # versions before did not store them
            check_entries(content, {"performers": dict[str, str]}, "summary")
        check_entries({"unit": "performer", **content}, {"unit": StatisticalUnit}, "summary")
        for n, row in enumerate(content["cells"]):
            if not re.fullmatch(r"\w+", str(row.get("key"))):
                raise BadFile(path, f"a cell called {row.get('key')!r}", "names of folders in cells/", advice)
            check_entries(row, {**_IDENTITY, **_METRICS}, f"cells[{n}]")
            _check_lag(row.get("lag", 0), f"cells[{n}].lag")
        for name, extra in (("methods", {}), ("behaviours", {"behaviour": str})):
            for n, row in enumerate(content[name]):
                check_entries(row, {**_GROUP, **extra}, f"{name}[{n}]")
                _check_lag(row.get("lag", 0), f"{name}[{n}].lag")
                check_entries(row["metrics"], _GROUP_METRICS, f"{name}[{n}].metrics")
                for metric, statistic in row["metrics"].items():
                    check_entries(statistic, _STATISTIC, f"{name}[{n}].metrics.{metric}")
        for name, kinds in (("recovery", _RECOVERY), ("expected_orders", _ORDER)):
            check_entries({name: content.get(name, [])}, {name: tuple[_Table, ...]}, "summary")
            for n, row in enumerate(content.get(name, [])):
                check_entries(row, kinds, f"{name}[{n}]")
    except (TypeError, UnknownName) as error:
        raise BadFile(path, str(error), "the summary of a run of this version of the harness", advice) from error


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
    later = {"sigma_coverage_95"} - scores.keys()  # of versions that did not write it
    for name, definition in SIGMA_DEFINITIONS.items() if scores else ():
        if name not in later and not _is_possible(name, scores.get(name), definition):
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
