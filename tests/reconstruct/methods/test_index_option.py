"""The option `index` of every method that searches: all indexes give nearly the same estimates on unseen motion."""

import numpy as np
import pytest

from harness.reconstruct.index.selection import INDEXES
from tests.reconstruct.methods.test_dynamic_map import hinges, mean_deg

METHODS = ("local_pca", "dynamic_map", "dynamic_map:window", "dynamic_map:literal", "kernel_cca", "weighted_blend")


@pytest.mark.parametrize("index", [name for name in INDEXES if name != "flat"])
@pytest.mark.parametrize("method", METHODS)
def test_an_index_changes_estimates_little(method: str, index: str) -> None:
    """Exact indexes change nothing but rounding; the others find most of the nearest."""
    exact, found = hinges(f"{method}[index=flat]", "walking"), hinges(f"{method}[index={index}]", "walking")
    assert mean_deg(found, exact) < (0.02 if index == "kd_tree" else 0.6)


def test_the_graph_is_used() -> None:
    """Its answers follow the last ones, so some estimates differ from those of exact search."""
    for method in ("local_pca", "kernel_cca"):
        exact, found = (hinges(f"{method}[index={index}]", "walking") for index in ("flat", "graph"))
        assert np.abs(exact - found).max() > 0.0
