"""Stored errors of methods by clip, from which comparisons with a known answer are drawn.

`null_errors.json` has errors of pairs of equally good methods on synthetic motion. In *settings*, B is the method A
with one constant changed slightly, on the same readings. In *draws*, B is the same method with another draw of the same
noise. `planted_errors.json` has errors by clip and seed on real motion, for planted worlds of a trust study. They were
made by

    harness run scenarios/gate/equally_good.toml --no-report
    harness run scenarios/gate/equally_good_again.toml --no-report
    python -m harness.bench.stored_errors results/equally_good results/equally_good_again
    harness run scenarios/gate/swapped_methods.toml --no-report
    python -m harness.bench.stored_errors results/swapped_methods

The second run was stopped after 26 of the 30 takes.
"""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.core.files import read_json, write_json
from harness.results import CellResult, load_results

METRICS = ("joint_angle_mean_deg", "mpjpe_mm", "jitter_m_s3")
KINDS = ("settings", "draws")
NULL_FILE = Path(__file__).with_name("null_errors.json")
PLANTED_FILE = Path(__file__).with_name("planted_errors.json")
CellsByClip = Mapping[str, Mapping[int, CellResult]]
"""Clip -> seed -> cell."""


def load_null_errors(kind: str) -> Floats:
    """Errors (M, K, C, 2) of M methods, K `METRICS` and C clips, of A and of B; `kind` is one of `KINDS`."""
    errors = read_json(NULL_FILE, "errors of equally good methods")[kind]["errors"]
    sides = [[(line["a"].split(), line["b"].split()) for line in metrics.values()] for metrics in errors.values()]
    return np.moveaxis(np.array(sides, float), 2, 3)


def load_planted_errors() -> Mapping[str, Floats]:
    """Method -> mean joint angle errors (C, S) of C clips and S draws of the tracker's noise [deg]."""
    errors = read_json(PLANTED_FILE, "stored errors of methods")["errors"]
    return {method: np.array([row.split() for row in rows], float) for method, rows in errors.items()}


def main(run: str, other_run: str = "") -> None:
    """Store the null errors of two runs, or the planted errors of one; BadFile for a folder that is no run."""
    cells = _cells_by_method(run)
    if not other_run:
        errors = {
            method: [_format_line([of[seed] for seed in sorted(of)], METRICS[0], 5) for _, of in sorted(clips.items())]
            for method, clips in cells.items()
        }
        names = sorted(next(iter(cells.values())))
        write_json(PLANTED_FILE, {"metric": METRICS[0], "clips": names, "errors": errors})
        return
    others = _cells_by_method(other_run)
    variants = {method.partition("[")[0]: method for method in cells if "[" in method}
    settings = _pair_errors({method: (cells[method], cells[variant]) for method, variant in variants.items()})
    draws = _pair_errors({method: (cells[method], others[method]) for method in variants})
    write_json(NULL_FILE, {"settings": settings, "draws": draws})


def _cells_by_method(run: str) -> dict[str, dict[str, dict[int, CellResult]]]:
    """Method -> clip -> seed -> cell."""
    found: dict[str, dict[str, dict[int, CellResult]]] = {}
    for cell in load_results(run).cells:
        found.setdefault(cell.method, {}).setdefault(cell.clip, {})[cell.seed] = cell
    return found


def _pair_errors(sides: Mapping[str, tuple[CellsByClip, CellsByClip]]) -> dict[str, Any]:
    """Errors on the common clips with six digits, as one text for each side, method and metric."""
    first = next(iter(sides.values()))[0]
    clips = [clip for clip in first if all(clip in one for pair in sides.values() for one in pair)]
    errors = {
        method: {
            metric: {
                name: _format_line([next(iter(cells[clip].values())) for clip in clips], metric, 6)
                for name, cells in zip("ab", pair, strict=True)
            }
            for metric in METRICS
        }
        for method, pair in sides.items()
    }
    return {"clips": clips, "errors": errors}


def _format_line(cells: list[CellResult], metric: str, digits: int) -> str:
    return " ".join(f"{np.nan if (v := cell.metrics[metric]) is None else v:.{digits}g}" for cell in cells)


if __name__ == "__main__":
    main(*sys.argv[1:])
