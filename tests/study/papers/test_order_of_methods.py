"""The papers' order of methods, on motion that no baseline and no published table has seen."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.errors import Outcome
from harness.experiment import run
from harness.experiment.scenarios import load_scenario
from harness.mocap.synthetic import BEHAVIOURS
from harness.results import load_results

ORDERS = [
    ("dynamic_map", "local_pca", "ik"),  # Liu et al. 2011, Fig. 6
    ("dynamic_map:literal", "ik"),
    ("kernel_cca", "ik"),  # Kim et al. 2012: learnt methods against none
    ("kernel_cca:literal", "weighted_blend:literal"),  # Kim et al. 2012, Fig. 4
]


@pytest.mark.slow
@pytest.mark.parametrize("inputs", ["pos+ori", "pos"])
def test_the_order_of_both_papers_holds_on_unseen_motion(tmp_path: Path, inputs: str) -> None:
    """Fifteen takes of five behaviours by performers 4 to 6, seed 23; examples are one other take of each performer."""
    gate = load_scenario("gate")
    shown = [(behaviour, f"{behaviour}_{who}") for behaviour in BEHAVIOURS for who in ("p4", "p5", "p6")]
    motion = replace(
        gate.motion,
        test=tuple(f"{take}_01" for _, take in shown),
        examples=tuple(f"{take}_02" for _, take in shown),
        behaviours=tuple(behaviour for behaviour, _ in shown),
    )
    methods = tuple(dict.fromkeys(method for order in ORDERS for method in order))
    scenario = replace(gate, seed=23, motion=motion, methods=methods, inputs=(inputs,))
    assert run(scenario, tmp_path / "run", jobs=2) is Outcome.PASS
    errors: dict[str, list[float]] = {method: [] for method in methods}
    for cell in load_results(tmp_path / "run").cells:
        errors[cell.method].append(float(cell.metrics["joint_angle_mean_deg"] or np.nan))
    means = {method: float(np.mean(values)) for method, values in errors.items()}
    assert all(len(values) == 15 for values in errors.values())
    for order in ORDERS:
        assert sorted(order, key=means.__getitem__) == list(order), means
