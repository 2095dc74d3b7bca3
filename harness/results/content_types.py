"""Types of what cells and summaries hold as JSON, checked before other code relies on them."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from harness.core.fields import check_entries
from harness.core.split import StatisticalUnit
from harness.errors import BadFile, HarnessError, UnknownName
from harness.score.metrics import DEFINITIONS

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
