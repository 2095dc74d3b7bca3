"""Errors of pairs of equally good methods by clip, on synthetic motion: the population of simulated comparisons.

`null_errors.json` has two kinds. In *settings*, B is the method A with one constant changed slightly, on the same
readings. In *draws*, B is the same method with another draw of the same noise. It was made by

    harness run scenarios/gate/equally_good.toml --no-report
    harness run scenarios/gate/equally_good_again.toml --no-report
    python -m harness.bench.null_errors results/equally_good results/equally_good_again

The second run was stopped after 26 of the 30 takes.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.core.files import read_json, write_json
from harness.results.reader import CellResult, ResultSet, load_results

METRICS = ("joint_angle_mean_deg", "mpjpe_mm", "jitter_m_s3")
KINDS = ("settings", "draws")
FILE = Path(__file__).with_suffix(".json")
CellsByClip = Mapping[str, CellResult]
"""Clip -> cell."""


@dataclass(frozen=True, eq=False)
class ErrorPopulation:
    """Errors of M methods, K metrics and C clips."""

    methods: tuple[str, ...]
    clips: tuple[str, ...]
    errors: Floats
    """(M, K, C, 2) errors of A and of B."""


def load_population(kind: str) -> ErrorPopulation:
    """Load one of the `KINDS` of errors."""
    content = read_json(FILE, "errors of equally good methods")[kind]
    errors = [
        [np.array([sides["a"].split(), sides["b"].split()], float).T for sides in metrics.values()]
        for metrics in content["errors"].values()
    ]
    return ErrorPopulation(tuple(content["errors"]), tuple(content["clips"]), np.array(errors))


def main(run: str, other_run: str) -> None:
    """Store the errors of two runs; BadFile for a folder that is no run."""
    cells, other_cells = _cells_by_method(load_results(run)), _cells_by_method(load_results(other_run))
    variants = {method.partition("[")[0]: method for method in cells if "[" in method}
    content = {
        "settings": _pair_errors({method: (cells[method], cells[variant]) for method, variant in variants.items()}),
        "draws": _pair_errors({method: (cells[method], other_cells[method]) for method in variants}),
    }
    write_json(FILE, content)


def _cells_by_method(side: ResultSet) -> dict[str, dict[str, CellResult]]:
    """Method -> clip -> cell."""
    by_method: dict[str, dict[str, CellResult]] = {}
    for cell in side.cells:
        by_method.setdefault(cell.method, {})[cell.clip] = cell
    return by_method


def _pair_errors(sides: Mapping[str, tuple[CellsByClip, CellsByClip]]) -> dict[str, Any]:
    """Format errors on the common clips with six digits, as one text for each side, method and metric."""
    clips = [
        clip for clip in next(iter(sides.values()))[0] if all(clip in one for pair in sides.values() for one in pair)
    ]

    def text(cells: CellsByClip, metric: str) -> str:
        return " ".join(f"{cells[clip].metrics[metric]:.6g}" for clip in clips)

    errors = {
        method: {metric: {"a": text(a, metric), "b": text(b, metric)} for metric in METRICS}
        for method, (a, b) in sides.items()
    }
    return {"clips": clips, "errors": errors}


if __name__ == "__main__":
    main(*sys.argv[1:])
