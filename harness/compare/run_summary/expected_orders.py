"""Expected orders: rankings of errors that a paper states, and whether the results agree.

A scenario states them with the smallest error first:

    [[expected_order]]
    methods = ["dynamic_map", "local_pca", "ik"]
    source = "Liu et al. 2011, Fig. 6"
    why_not = { "local_pca > ik" = "why, where it comes out so" }

    [[expected_order]]
    inputs = ["pos+ori", "pos"]
    method = "dynamic_map"
    source = "Liu et al. 2011, boxing"

Each order is evaluated on the means over the clips on which all its methods (or inputs) were measured. Behaviours,
performers, varied values and, where methods are compared, inputs are evaluated separately. Errors are compared as
printed, so that a difference that tables do not show counts as none. `harness run` prints the result below its table,
and `summary.json` lists it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from harness.results import PRIMARY_METRIC, lag_of, varied_text

DECIMALS = 2
"""Decimals of the printed errors."""


@dataclass(frozen=True)
class ExpectedOrder:
    """An expected order of methods, or of the inputs of one method."""

    source: str
    """Paper and figure that state the order."""
    methods: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()
    method: str = ""
    """The method whose inputs are compared."""
    why_not: dict[str, str] = field(default_factory=dict)
    """"a > b" -> reason, for neighbours a and b of the order whose errors are in the opposite order."""

    @property
    def by(self) -> str:
        """Column of summary.csv whose values are ranked."""
        return "inputs" if self.inputs else "method"

    @property
    def names(self) -> tuple[str, ...]:
        return self.inputs or self.methods

    @property
    def steps(self) -> list[str]:
        """The possible violations: "a > b" for each two neighbours."""
        return [f"{less} > {more}" for less, more in pairwise(self.names)]


def evaluate_orders(orders: Sequence[ExpectedOrder], rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Evaluate orders on the rows of `summary.json`: one record for each order and setting.

    A record has `source`, `method` (whose inputs are compared, or ""), `names`, the setting (`behaviour`, `inputs`,
    `performer`, `varied`), the numbers of clips on which all (`clips`) and any (`clips_of_any`) were measured,
    `means_deg` or None, `holds` (None: not evaluated), and `why` (reasons for violations, or for no evaluation).
    """
    return [found for order in orders for found in _evaluate_by_group(order, rows)]


def _evaluate_by_group(order: ExpectedOrder, rows: Sequence[Mapping[str, Any]]) -> Iterator[dict[str, Any]]:
    settings: dict[tuple[str, ...], list[Mapping[str, Any]]] = {}
    for row in rows:
        if row[order.by] in order.names and order.method in ("", row["method"]):
            inputs = "" if order.inputs else row["inputs"]
            key = (row["behaviour"], inputs, row["performer"], varied_text(row["varied"]))
            settings.setdefault(key, []).append(row)
    nothing: tuple[str, ...] = ("", "", "", "")
    for (behaviour, inputs, performer, _), group in settings.items() or [(nothing, [])]:
        yield {
            "source": order.source,
            "method": order.method,
            "names": list(order.names),
            "behaviour": behaviour,
            "inputs": inputs,
            "performer": performer,
            "varied": group[0]["varied"] if group else {},
            **_outcome(order, group),
        }


def _outcome(order: ExpectedOrder, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    errors: dict[str, dict[str, float]] = {name: {} for name in order.names}
    for row in rows:
        if row[PRIMARY_METRIC] is not None:
            errors[row[order.by]][row["clip"]] = row[PRIMARY_METRIC]
    shared = sorted(set.intersection(*(set(each) for each in errors.values())))
    found = {"clips": len(shared), "clips_of_any": len({clip for each in errors.values() for clip in each})}
    if not shared:
        missing = [name for name, each in errors.items() if not each]
        gap = f"{', '.join(missing)} not measured" if missing else "no clip on which all were measured"
        return {**found, "means_deg": None, "holds": None, "why": [gap]}
    if len({lag_of(row) for row in rows}) > 1:
        return {**found, "means_deg": None, "holds": None, "why": ["methods with different lags are not ranked"]}
    means = [float(np.mean([each[clip] for clip in shared])) for each in errors.values()]
    as_printed = [round(mean, DECIMALS) for mean in means]
    wrong = [step for step, (less, more) in zip(order.steps, pairwise(as_printed), strict=True) if not less < more]
    why = [f"{step}: {order.why_not.get(step, 'no reason is known')}" for step in wrong]
    return {**found, "means_deg": means, "holds": not wrong, "why": why}
