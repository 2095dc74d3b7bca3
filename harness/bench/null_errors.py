"""Errors of equally good sides, clip by clip, on the built-in performer: what simulated studies are drawn from.

`gate_errors.json` holds two kinds. In *settings* B is the same method as A with one constant moved a little, on the
same readings; in *draws* it is the very same method under another draw of the same noise. It was made by

    harness run scenarios/gate/equally_good.toml --no-report
    harness run scenarios/gate/equally_good_again.toml --no-report
    python -m harness.bench.null_errors results/equally_good results/equally_good_again

where the second run was stopped after 26 of the 30 takes.
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
"""By clip."""


@dataclass(frozen=True, eq=False)
class ErrorPopulation:
    """M methods, K metrics, C clips."""

    methods: tuple[str, ...]
    clips: tuple[str, ...]
    errors: Floats
    """(M, K, C, 2) of A and of B."""


def load_population(kind: str) -> ErrorPopulation:
    """One of `KINDS`, as stored."""
    content = read_json(FILE, "errors of equally good sides")[kind]
    errors = [
        [np.array([sides["a"].split(), sides["b"].split()], float).T for sides in metrics.values()]
        for metrics in content["errors"].values()
    ]
    return ErrorPopulation(tuple(content["errors"]), tuple(content["clips"]), np.array(errors))


def main(run: str, again: str) -> None:
    """Store what two runs measured; BadFile for what is no run."""
    one, other = _cells_by_method(load_results(run)), _cells_by_method(load_results(again))
    moved = {method.partition("[")[0]: method for method in one if "[" in method}
    content = {
        "settings": _pair_errors({method: (one[method], one[by]) for method, by in moved.items()}),
        "draws": _pair_errors({method: (one[method], other[method]) for method in moved}),
    }
    write_json(FILE, content)


def _cells_by_method(side: ResultSet) -> dict[str, dict[str, CellResult]]:
    """Method -> clip -> cell."""
    found: dict[str, dict[str, CellResult]] = {}
    for cell in side.cells:
        found.setdefault(cell.method, {})[cell.clip] = cell
    return found


def _pair_errors(sides: Mapping[str, tuple[CellsByClip, CellsByClip]]) -> dict[str, Any]:
    """Six digits of every error on the clips that all have, a text for each side, method and metric."""
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
