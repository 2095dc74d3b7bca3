"""Fabricated comparisons in the form that the regression gate writes; none of their numbers was measured."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from harness.compare.comparison import Comparison, Difference, Verdict
from harness.compare.units import BY_NAME
from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.errors import Outcome

METRICS = {"joint_angle_mean_deg": ("deg", 2.0, 0.03), "mpjpe_mm": ("mm", 12.0, 0.03), "step_relative": ("x", 6.0, 0.1)}
"""Metric -> unit, size, margin as a share of A's mean."""
METHODS = {"ik": 0.0, "local_pca": 0.05, "dynamic_map": -0.06}
"""Method -> relative increase of the error in B."""
GROUP = "pos+ori, sequence, known"
CIRCUMSTANCES = (
    ("commit", "0123456789abcdef0123456789abcdef01234567", "89abcdef0123456789abcdef0123456789abcdef"),
    ("dirty", "no", "yes"),
    ("source_hash", "0123456789abcdef", "fedcba9876543210"),
    ("packages.numpy", "2.3.1", "2.4.0"),
    ("constants.local_pca", "LocalPca(neighbours=60)", "LocalPca(neighbours=20)"),
)


def line(method: str, metric: str, clips: int, change: float, group: str = GROUP, scatter: float = 0.02) -> Difference:
    """A line of `clips` clips whose errors vary much, with errors in B larger by about the share `change`."""
    unit, size, share = METRICS[metric]
    rng = generator(1, "made-up comparison", method, metric, group)
    a = size * np.exp(rng.normal(0.0, 0.35, clips))
    b = a * (1.0 + change + scatter * rng.normal(size=clips)) if change else a
    return judged(method, group, metric, unit, a, b, share * float(a.mean()) if clips else 0.0)


def judged(method: str, group: str, metric: str, unit: str, a: Floats, b: Floats, margin: float) -> Difference:
    """A line with a normal-theory interval and the verdict that follows from it."""
    step, clips = b - a, len(a)
    mean = float(step.mean()) if clips else 0.0
    half = 2.1 * float(step.std(ddof=1)) / clips**0.5 if clips >= 6 else 0.0
    low, high = (mean - half, mean + half) if clips >= 6 else (None, None)
    p = None if clips < 6 else 1.0 if mean == 0.0 else 0.0004 if abs(mean) > half else 0.31
    verdict, why = _verdict(mean, low, high, margin, clips)
    names = tuple(f"walking_p{n + 1}_01" for n in range(clips))
    return Difference(
        method=method,
        group=group,
        part="",
        metric=metric,
        unit=unit,
        clips=names,
        a=tuple(map(float, a)),
        b=tuple(map(float, b)),
        units=tuple(BY_NAME.unit_of(name) for name in names),
        mean_a=float(a.mean()) if clips else 0.0,
        mean_b=float(b.mean()) if clips else 0.0,
        difference=mean,
        low=low,
        high=high,
        p=p,
        p_holm=p if p is None else min(1.0, 9.0 * p),
        margin=margin,
        verdict=verdict,
        why=why,
        gated=True,
    )


def comparison(
    clips: int = 24, methods: Sequence[str] = tuple(METHODS), metrics: Sequence[str] = ("mpjpe_mm", "step_relative")
) -> Comparison:
    """A comparison with every verdict: same, worse and better, and cannot tell for the last metric."""
    lines = [line(method, metric, clips, METHODS[method]) for method in methods for metric in metrics]
    if len(methods) == len(METHODS):
        lines[-1] = line(methods[-1], metrics[-1], clips, 0.1, scatter=0.5)
    lines.append(replace(lines[0], metric="jitter_m_s3", unit="m/s³", gated=False, p_holm=None))
    return whole(lines)


def whole(lines: Sequence[Difference], why: str = "") -> Comparison:
    """A comparison of these lines, with the outcome that follows from them."""
    verdicts = {line.verdict for line in lines if line.gated}
    outcome = Outcome.NOT_COMPARABLE if "cannot tell" in verdicts or not verdicts else Outcome.PASS
    if "worse" in verdicts:
        outcome = Outcome.REGRESSED
    return Comparison(
        a="baseline gate",
        b="results/gate",
        differences=tuple(lines),
        matched=sum(len(line.clips) for line in lines),
        only_a=(),
        only_b=(),
        inputs_that_differ=(),
        allowed=(),
        circumstances=CIRCUMSTANCES,
        outcome=outcome,
        why=why or f"{len(lines)} lines were judged",
    )


def _verdict(mean: float, low: float | None, high: float | None, margin: float, clips: int) -> tuple[Verdict, str]:
    if low is None or high is None:
        return "cannot tell", f"too few units: {clips}, of at least 6"
    if low >= -margin and high <= margin:
        return "same", "within the margin"
    if (low > 0.0 or high < 0.0) and abs(mean) > margin:
        return ("worse" if mean > 0.0 else "better"), "beyond the margin"
    return "cannot tell", "the interval is wider than the margin"
