"""Made-up findings of a trust study: pairs, margins and distances of every verdict."""

from dataclasses import replace
from typing import Any

from harness.errors import Outcome
from harness.results.trust_findings import (
    Equivalence,
    ErrorDistance,
    PairAgreement,
    RankCorrelation,
    SideDifference,
    StationHealth,
    StreamHealth,
    TrustCapture,
    TrustFindings,
)

METRIC = "joint_angle_mean_deg"
ARMS = ("ik", "local_pca", "dynamic_map", "kernel_cca")
MEANS = {"ik": (14.2, 14.5), "local_pca": (9.1, 9.3), "dynamic_map": (9.8, 8.4), "kernel_cca": (11.6, 11.9)}
"""Arm -> mean error on the device and in the simulation."""
DIGEST = "5d1f" * 16


def made_up_trust() -> TrustFindings:
    """A study that contradicts in one pair and exceeds one margin."""
    return TrustFindings(
        title="Walking with six stations",
        scenario="walking",
        unit="unit.toml",
        unit_digest="ab12" * 16,
        plan_digest=DIGEST,
        exploratory=False,
        level=0.05,
        ranked_metric=METRIC,
        seeds=(1, 2, 3, 4, 5),
        captures=tuple(
            TrustCapture(f"walk_{n:02d}.is900rec", f"walking_p{n:02d}", "0f" * 32, DIGEST, 2400) for n in range(8)
        ),
        arms=ARMS,
        health=tuple(
            StationHealth(
                station,
                StreamHealth(40.0, 0.012, 3.1, 0.21, 0.93, 0.001),
                StreamHealth(40.0, 0.010, 2.8, None, 0.94, 0.0),
            )
            for station in ("head", "left_wrist", "right_wrist")
        ),
        distances=(
            ErrorDistance("head", "position error", "m", 0.00012, 0.00030, 0.41, 1.0, 5.2, (40, 200)),
            ErrorDistance("left_wrist", "position error", "m", 0.00091, 0.00035, 0.001, 0.006, 5.2, (40, 200)),
            ErrorDistance("right_wrist", "position error", "m", -0.00002, 0.00033, 0.6, 1.0, 5.2, (40, 200)),
            ErrorDistance("head", "orientation error", "rad", 0.0002, 0.0005, 0.001, 0.006, 5.2, (40, 200)),
            ErrorDistance("pelvis", "orientation error", "rad", None, None, None, None, 5.2, (3, 200), "3 blocks"),
        ),
        equivalences=tuple(_equivalence(arm) for arm in ARMS),
        pairs=tuple(_pair(a, b) for n, a in enumerate(ARMS) for b in ARMS[n + 1 :]),
        rank_correlations=(
            RankCorrelation("Kendall's tau-b", 0.67, 0.33, 1.0),
            RankCorrelation("sim-to-real correlation", None, None, None, "2 arms and 8 clips"),
        ),
        outcome=Outcome.REGRESSED,
        why="one pair contradicts",
        notes=("Two stations of the scenario were not captured.",),
    )


def trust_of(outcome: Outcome, **changes: Any) -> TrustFindings:
    """The study with another outcome, and other findings."""
    return replace(made_up_trust(), outcome=outcome, **changes)


def empty_trust() -> TrustFindings:
    """A study in which nothing could be compared."""
    parts = ("captures", "health", "distances", "equivalences", "pairs", "rank_correlations", "notes")
    return trust_of(Outcome.NOT_COMPARABLE, why="no capture has a frame", **dict.fromkeys(parts, ()))


def _equivalence(arm: str) -> Equivalence:
    device, simulated = MEANS[arm]
    difference = simulated - device
    low, high = difference - 0.3, difference + 0.3
    if arm == "dynamic_map":
        return Equivalence(
            arm, METRIC, 1.0, 8, device, simulated, difference, low, high, "beyond the margin", "outside"
        )
    if arm == "kernel_cca":
        return Equivalence(arm, METRIC, 0.5, 8, device, simulated, difference, low, high, "cannot tell", "wide")
    return Equivalence(arm, METRIC, 1.0, 8, device, simulated, difference, low, high, "equivalent", "inside")


def _pair(a: str, b: str) -> PairAgreement:
    device, simulated = (MEANS[a][side] - MEANS[b][side] for side in (0, 1))
    on_device = SideDifference(device, device - 0.4, device + 0.4, 0.004)
    if (a, b) == ("local_pca", "kernel_cca"):
        wide = SideDifference(simulated, simulated - 3.0, simulated + 3.0, 0.2)
        why = "no significant difference on the simulation"
        return PairAgreement(a, b, 8, on_device, wide, 0.2, 0.4, "cannot tell", why)
    in_simulation = SideDifference(simulated, simulated - 0.4, simulated + 0.4, 0.004)
    if device * simulated > 0.0:
        return PairAgreement(a, b, 8, on_device, in_simulation, 0.004, 0.024, "agree", "both sides show the same order")
    return PairAgreement(
        a, b, 8, on_device, in_simulation, 0.004, 0.024, "contradict", "each side shows the other order"
    )
