"""One side of a comparison: what a run, a sweep or a baseline measured, cell by cell."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from harness.score.manifest import Manifest


@dataclass(frozen=True)
class JudgedCell:
    """One method on one clip: what it is, what it rests on, what it scored."""

    scenario: str
    clip: str
    seed: int
    method: str
    inputs: str
    protocol: str
    noise: str
    varied: Mapping[str, Any]
    """Scenario key -> value, of the keys that the scenario varies."""
    behaviour: str
    performer: str
    """ "known", "new", or "" without examples (see `cell.Cell`)."""
    defined_by: Mapping[str, Any]
    """Everything that two results must agree on to be comparable."""
    metrics: Mapping[str, float | None]
    """By name; None is "not measured"."""


@dataclass(frozen=True)
class Judged:
    """Everything that one side has."""

    title: str
    """As the reader named it, such as "results/demo" or "baseline gate"."""
    manifest: Manifest
    cells: tuple[JudgedCell, ...]
    """Those that are finished, in the order of their tables."""
    planned: int
    failed: tuple[str, ...] = ()
    """Names of planned cells that failed."""
