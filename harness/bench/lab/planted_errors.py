"""Stored errors of methods by clip and seed, from which planted worlds of a trust study are drawn.

`planted_errors.json` was made on real motion by

    harness run scenarios/gate/swapped_methods.toml --no-report
    python -m harness.bench.lab.planted_errors results/swapped_methods
"""

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from harness.core.arrays import Floats
from harness.core.files import read_json, write_json
from harness.results.reader import load_results

METRIC = "joint_angle_mean_deg"
FILE = Path(__file__).with_suffix(".json")


def load_planted_errors() -> Mapping[str, Floats]:
    """Method -> mean joint angle errors (C, S) of C clips and S draws of the tracker's noise [deg]."""
    errors = read_json(FILE, "stored errors of methods")["errors"]
    return {method: np.array([row.split() for row in rows], float) for method, rows in errors.items()}


def main(run: str) -> None:
    """Store the errors of a run with several seeds; BadFile for a folder that is no run."""
    found: dict[str, dict[str, dict[int, float]]] = {}
    for cell in load_results(run).cells:
        found.setdefault(cell.method, {}).setdefault(cell.clip, {})[cell.seed] = float(cell.metrics[METRIC] or np.nan)
    errors = {
        method: [" ".join(f"{by_seed[seed]:.5g}" for seed in sorted(by_seed)) for _, by_seed in sorted(clips.items())]
        for method, clips in found.items()
    }
    clips = sorted(next(iter(found.values())))
    write_json(FILE, {"metric": METRIC, "clips": clips, "errors": errors})


if __name__ == "__main__":
    main(*sys.argv[1:])
