"""Fabricated folders of sweeps, written through the real index; none of their numbers was measured."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.files import content_key
from harness.core.seeds import generator
from harness.results.digests import write_result_json
from harness.results.index import CellIndex
from harness.results.manifest import Manifest

COMMAND = "harness sweep made_up.toml --out results/made_up"
FAILURE = "Traceback (most recent call last):\n  somewhere\nValueError: <b>no</b> pose & no plan"


@dataclass(frozen=True)
class Plan:
    """What the fabricated sweep contains."""

    scenarios: Sequence[str] = ("walking", "boxing")
    clips: int = 7
    methods: Mapping[str, float] = field(default_factory=lambda: {"ik": 3.0, "local_pca": 1.6, "dynamic_map": 1.4})
    """Method -> its error [deg]."""
    vary: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    """Key -> values; the n-th makes errors larger by n tenths."""
    seeds: Sequence[int] = (1,)
    performers: Sequence[str] = ("known",)
    failing: tuple[str, ...] = ()
    """Methods whose cells fail."""
    to_come: int = 0
    """Cells that are planned, and neither finished nor failed."""
    unmeasured: tuple[str, ...] = ()
    """Methods whose metrics are None."""
    lags: Mapping[str, int] = field(default_factory=dict)
    """Method -> its lag [frames]."""


def fabricate_sweep(out: Path, plan: Plan | None = None) -> Path:
    """Write the folder with its index; the same plan gives the same rows."""
    plan = plan or Plan()
    out.mkdir(parents=True, exist_ok=True)
    named, rows, failed = [], [], []
    values = [list(enumerate(each)) for each in plan.vary.values()]
    for scenario, seed, combination, clip, method in itertools.product(
        plan.scenarios, plan.seeds, itertools.product(*values), range(plan.clips), plan.methods
    ):
        varied = {key: value for key, (_, value) in zip(plan.vary, combination, strict=True)}
        cell = f"{scenario} seed {seed}: {method} on {scenario}_p{clip + 1}_01 ({varied})"
        named.append(cell)
        if method in plan.failing:
            failed.append((cell, "", FAILURE))
            continue
        worse = 1.0 + 0.1 * sum(place for place, _ in combination)
        rows.append(_row(scenario, seed, clip, method, worse, varied, plan))
    with CellIndex(out) as index:
        index.expect([*named, *(f"to come {n}" for n in range(plan.to_come))])
        index.add(rows)
        finished = [name for name in named if name not in {cell for cell, *_ in failed}]
        index.record_outcomes([(name, row["key"], "") for name, row in zip(finished, rows, strict=True)])
        index.record_outcomes(failed)
        index.note(kind="sweep", name="made_up", command=COMMAND)
        index.write_digest({})
    for row in rows:
        (out / "cells" / str(row["key"])).mkdir(parents=True)
    write_result_json(out / "manifest.json", Manifest({}, {}, {}).as_dict())
    return out


def _row(
    scenario: str, seed: int, clip: int, method: str, worse: float, varied: Mapping[str, Any], plan: Plan
) -> dict[str, Any]:
    rng = generator(seed, "made-up sweep", scenario, method, clip, str(varied))
    error = plan.methods[method] * worse * float(np.exp(0.2 * rng.normal()))
    known = method not in plan.unmeasured
    return {
        "key": content_key([scenario, seed, method, clip, varied]),
        "scenario": scenario,
        "clip": f"{scenario}_p{clip + 1}_01",
        "behaviour": scenario,
        "method": method,
        "inputs": "pos+ori",
        "split": "none" if method == "ik" else "sequence",
        "performer": plan.performers[clip % len(plan.performers)],
        "noise": "default",
        "seed": seed,
        "varied": varied,
        **({"lag": plan.lags[method]} if method in plan.lags else {}),
        "joint_angle_mean_deg": error if known else None,
        "mpjpe_mm": 6.0 * error if known else None,
        "mpjre_deg": 1.7 * error if known else None,
        "jitter_m_s3": 500.0 if known else None,
        "step_p50_ms": 0.5,
        "coverage": 1.0 if known else 0.2,
    }
