"""Errors of one method by condition, clip and seed, and their file in `results/baselines/`.

The file is JSON with one line for each clip, so that a change of it can be reviewed.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.core import files
from harness.core.file_kind import wrong_file
from harness.errors import BadFile, BadInput
from harness.results.files import BASELINES, insert_digest, read_result_json

SCHEMA = 1
ANGLE = "joint_angle_mean_deg"
POSITION = "mpjpe_mm"
JITTER, TRUE_JITTER = "jitter_m_s3", "jitter_true_m_s3"
SKATE, TRUE_SKATE = "foot_skate_mm_s", "foot_skate_true_mm_s"
CELL_METRICS = (ANGLE, POSITION, JITTER, TRUE_JITTER, SKATE, TRUE_SKATE)
"""Metrics of a cell that are kept for every condition (docs/metrics.md)."""
SILENT_ANGLE = "joint_angle_silent_deg"
"""Mean joint angle error while the station is silent [deg]; only where one is."""
COVERAGES = ("sigma_coverage_1", "sigma_coverage_95")
"""Shares of errors within one stated sigma and within the stated 95 % region; only of methods that state them."""
SIGNIFICANT_DIGITS = 6
DEFAULT_BASELINE = BASELINES / "accuracy" / "dynamic_map_40f3d61.json"
"""Errors of `dynamic_map` of commit 40f3d61, relative to the root of a source checkout."""
SETUP_BASELINES = tuple(
    BASELINES / "accuracy" / f"{method}_23b301b.json" for method in ("ik", "kernel_cca", "dynamic_map", "expert_map")
)
"""Errors of four methods of commit 23b301b under every set-up."""
_EXPECTED = "errors by clip, as `harness bench accuracy --save` writes them"
_ADVICE = "Work in the root of a source checkout, restore the file there, or name another with --baseline."


@dataclass(frozen=True)
class ClipErrors:
    """Errors of one method on one clip under one condition."""

    behaviour: str
    performer: str
    """ "known" or "new", as of a method with examples."""
    by_metric: Mapping[str, tuple[float | None, ...]]
    """Metric -> one value for each seed; None where it was not measured, such as skate without a contact."""

    def mean(self, metric: str) -> float | None:
        """Mean over the seeds, those without a value left out; None without any value."""
        values = [value for value in self.by_metric.get(metric, ()) if value is not None]
        return float(np.mean(values)) if values else None

    def first_seeds(self, count: int) -> "ClipErrors":
        """The errors of the first `count` seeds."""
        return ClipErrors(self.behaviour, self.performer, {k: v[:count] for k, v in self.by_metric.items()})


ErrorsByCondition = Mapping[str, Mapping[str, ClipErrors]]
"""Name of a condition -> clip -> errors."""


@dataclass(frozen=True)
class StoredErrors:
    """Errors of one method of one commit under many conditions."""

    method: str
    commit: str
    """Commit of the code that was measured, 40 hex digits."""
    seeds: tuple[int, ...]
    """Seeds of the conditions with noise, in the order of the values; `clean` has the first one."""
    conditions: ErrorsByCondition

    @property
    def title(self) -> str:
        """Name in tables, such as "dynamic_map of 40f3d61"."""
        return f"{self.method} of {self.commit[:7]}"

    def first_seeds(self, seeds: Sequence[int]) -> ErrorsByCondition:
        """The errors of the first seeds; BadInput unless `seeds` are the first of the stored ones."""
        if not seeds or tuple(seeds) != self.seeds[: len(seeds)]:
            stored, given = (", ".join(map(str, some)) for some in (self.seeds, seeds))
            raise BadInput(f"The stored errors have the seeds {stored}, not {given}.", "Use the first of these.")
        return {
            name: {clip: errors.first_seeds(len(seeds)) for clip, errors in by_clip.items()}
            for name, by_clip in self.conditions.items()
        }


def write_errors(path: Path, stored: StoredErrors) -> None:
    """Write errors with six significant digits and a digest."""
    conditions = []
    for name, by_clip in stored.conditions.items():
        clips = ",\n".join(f"   {json.dumps(clip)}: {_as_line(errors)}" for clip, errors in by_clip.items())
        conditions.append(f"  {json.dumps(name)}: {{\n{clips}\n  }}")
    head = {"schema": SCHEMA, "method": stored.method, "commit": stored.commit, "seeds": stored.seeds}
    lines = [f" {json.dumps(name)}: {json.dumps(value)}" for name, value in head.items()]
    lines.append(' "conditions": {\n' + ",\n".join(conditions) + "\n }")
    files.write_text(path, insert_digest("{\n" + ",\n".join(lines) + "\n}\n"))


def _as_line(errors: ClipErrors) -> str:
    content: dict[str, Any] = {"behaviour": errors.behaviour, "performer": errors.performer}
    for metric, values in errors.by_metric.items():
        content[metric] = [None if v is None else float(f"{v:.{SIGNIFICANT_DIGITS}g}") for v in values]
    return json.dumps(content, allow_nan=False)


def read_errors(path: Path) -> StoredErrors:
    """Read the errors that `write_errors` wrote; BadFile when the file is missing, damaged, edited or malformed."""
    content = read_result_json(path, _EXPECTED, _ADVICE)
    if content.get("schema") != SCHEMA:
        found = "no schema" if "schema" not in content else f"schema {content['schema']!r}"
        raise wrong_file(path, found, f"{_EXPECTED} (schema {SCHEMA})", _ADVICE)
    try:
        seeds = tuple(_seed(value) for value in content["seeds"])
        conditions = {
            str(name): {str(clip): _read_clip(entry, len(seeds)) for clip, entry in by_clip.items()}
            for name, by_clip in content["conditions"].items()
        }
        return StoredErrors(str(content["method"]), str(content["commit"]), seeds, conditions)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        found = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise BadFile(path, found, _EXPECTED, _ADVICE) from error


def _read_clip(entry: Mapping[str, Any], seeds: int) -> ClipErrors:
    by_metric = {name: entry[name] for name in (*CELL_METRICS, SILENT_ANGLE, *COVERAGES) if name in entry}
    for name in (ANGLE, POSITION):
        if name not in by_metric:
            raise ValueError(f"a clip without {name}")
    for name, values in by_metric.items():
        if not isinstance(values, list) or len(values) not in (1, seeds) or not all(map(_is_error, values)):
            raise ValueError(f"{name} is {values!r}")
    if None in by_metric[ANGLE]:
        raise ValueError(f"a clip without a value of {ANGLE}")
    return ClipErrors(str(entry["behaviour"]), str(entry["performer"]), {k: tuple(v) for k, v in by_metric.items()})


def _is_error(value: object) -> bool:
    """Whether a value is a number that an error can have, or null."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value is None
    return math.isfinite(value) and value >= 0.0


def _seed(value: object) -> int:
    if not isinstance(value, int) or isinstance(value, bool):
        raise ValueError(f"seed {value!r}")
    return value
