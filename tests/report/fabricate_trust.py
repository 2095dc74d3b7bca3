"""Content of a page on trust with made-up values: every verdict, a gap without a duration, a damaged capture."""

from harness.errors import Outcome
from harness.report.lab.trust_content import TrustReport
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

ARMS = ("ik, all", "local_pca, all", "dynamic_map, all", "ik, four")
CLIPS = ("walking_p1_01", "walking_p2_01", "boxing_p1_01", "boxing_p2_01", "jumping_p1_01", "golf_p1_01", "golf_p2_01")


def fabricate_trust(*, exploratory: bool = False, outcome: Outcome = Outcome.REGRESSED) -> TrustReport:
    """A study of four arms on seven captures."""
    return TrustReport(
        TrustFindings(
            title="our IS-900, spring",
            scenario="lab",
            unit="unit.toml",
            unit_digest="c" * 64,
            plan_digest="a" * 64,
            exploratory=exploratory,
            level=0.05,
            ranked_metric="joint_angle_mean_deg",
            seeds=(1, 2, 3, 4, 5),
            captures=tuple(
                TrustCapture(f"{clip}.rec", clip, "b" * 64, "a" * 64, 320, ("12 bytes at byte 4,096",) if not k else ())
                for k, clip in enumerate(CLIPS)
            ),
            arms=ARMS,
            health=(
                StationHealth(
                    "head",
                    StreamHealth(39.98, 0.012, 2.1, 0.35, 0.97, 0.001),
                    StreamHealth(40.0, 0.01, 1.9, 0.31, 0.98, 0.0),
                ),
                StationHealth(
                    "left_hand",
                    StreamHealth(39.98, 0.0, 0.0, None, 0.99, 0.0),
                    StreamHealth(40.0, 0.02, 3.4, 0.4, 0.9, 0.0),
                ),
            ),
            distances=(
                ErrorDistance("head", "position error", "m", 0.00021, 0.00048, 0.31, 0.62, 1.9, (62, 62)),
                ErrorDistance("head", "orientation error", "rad", 0.0031, 0.0007, 0.001, 0.004, 2.4, (50, 50)),
                ErrorDistance("left_hand", "position error", "m", -0.00004, 0.0005, 0.7, 0.7, 1.1, (98, 98)),
                ErrorDistance(
                    "left_hand",
                    "orientation error",
                    "rad",
                    None,
                    None,
                    None,
                    None,
                    0.0,
                    (0, 0),
                    "3 blocks of 900 samples",
                ),
            ),
            equivalences=(
                _equivalence("ik, all", 0.5, 3.75, 3.56, (-0.35, -0.03), "equivalent"),
                _equivalence("local_pca, all", 0.5, 2.32, 2.81, (0.31, 0.67), "cannot tell"),
                _equivalence("dynamic_map, all", 0.5, 2.15, 3.02, (0.71, 1.03), "beyond the margin"),
                _equivalence("ik, four", 0.5, 4.81, 4.7, (-0.2, 0.02), "equivalent"),
            ),
            pairs=(
                _pair("ik, all", "local_pca, all", (1.4, 1.2, 1.6, 1e-6), (0.75, 0.5, 1.0, 1e-5), 4e-5, "agree"),
                _pair(
                    "local_pca, all",
                    "dynamic_map, all",
                    (0.17, 0.05, 0.29, 0.01),
                    (-0.21, -0.3, -0.12, 1e-4),
                    0.03,
                    "contradict",
                ),
                _pair("ik, all", "dynamic_map, all", (1.6, 1.2, 2.0, 1e-5), (0.54, 0.3, 0.78, 0.001), 0.004, "agree"),
                _pair("ik, all", "ik, four", (-1.06, -2.2, 0.1, 0.06), (-1.14, -1.4, -0.9, 1e-6), 0.06, "cannot tell"),
            ),
            rank_correlations=(
                RankCorrelation("Kendall's tau-b", 0.67, 0.33, 1.0),
                RankCorrelation("sim-to-real correlation", 0.94, 0.81, 0.98),
            ),
            outcome=outcome,
            why="local_pca, all and dynamic_map, all contradict; and 1 more.",
            notes=("2 errors were not measured: too few frames have an estimate.",),
        ),
        "harness trust plan.toml captures/*.rec --out results/trust",
    )


def _equivalence(
    arm: str, margin: float, device: float, simulated: float, interval: tuple[float, float], verdict: str
) -> Equivalence:
    why = {
        "equivalent": "the whole interval lies within the margin",
        "beyond the margin": "the whole interval lies beyond the margin",
        "cannot tell": "the interval contains an end of the margin",
    }[verdict]
    difference = simulated - device
    metric = "joint_angle_mean_deg"
    return Equivalence(arm, metric, margin, 7, device, simulated, difference, *interval, verdict, why)  # type: ignore[arg-type]


def _pair(
    a: str,
    b: str,
    device: tuple[float, float, float, float],
    simulated: tuple[float, float, float, float],
    p_holm: float,
    verdict: str,
) -> PairAgreement:
    why = {
        "agree": "both sides show the same order",
        "contradict": "each side shows the other order",
        "cannot tell": "no significant difference on the device",
    }[verdict]
    sides = SideDifference(*device), SideDifference(*simulated)
    return PairAgreement(a, b, 7, *sides, max(device[3], simulated[3]), p_holm, verdict, why)  # type: ignore[arg-type]
