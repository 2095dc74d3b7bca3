"""Scores of the standard deviations that a method states for its hinge angles (docs/metrics.md, part D).

Errors are those of D1: wrapped differences of hinge angles. Frames of several clips are pooled by adding `SigmaSums`.
"""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats, freeze
from harness.core.estimate import HALF_WIDTH_95
from harness.core.humanoid24 import QPOS_OF_DOF, unpack
from harness.errors import ShapeError
from harness.score.angles import wrap_difference
from harness.score.metrics import Definition

SIGMA_DEFINITIONS: dict[str, Definition] = {
    "sigma_coverage_1": Definition(
        "share", "frames and hinges whose error lies within one stated standard deviation; 0.683 for a normal error"
    ),
    "sigma_coverage_2": Definition(
        "share", "frames and hinges whose error lies within two stated standard deviations; 0.954 for a normal error"
    ),
    "sigma_coverage_95": Definition(
        "share",
        "frames and hinges whose error lies within the stated 95 % region, 2.66 standard deviations (Student's t)",
    ),
    "sigma_lowest_coverage_1": Definition("share", "the lowest `sigma_coverage_1` of any one hinge"),
    "sigma_width_deg": Definition("deg", "mean stated standard deviation of the hinge angles"),
    "sigma_log_score": Definition(
        "nat", "mean negative logarithm of the stated normal density of the true angle, per degree; lower is better"
    ),
}
"""Scores of methods that state standard deviations, by name. Methods that state none have no such score."""


@dataclass(frozen=True, eq=False)
class SigmaSums:
    """Sums over frames, for each of D hinges in the skeleton's order; ShapeError if the arrays disagree about D."""

    frames: int
    within_1: Floats
    """(D,) number of frames whose error lies within one standard deviation."""
    within_2: Floats
    """(D,) number of frames whose error lies within two standard deviations."""
    within_95: Floats
    """(D,) number of frames whose error lies within the stated 95 % region."""
    sigma_deg: Floats
    """(D,) sum of the standard deviations [deg]."""
    log_score: Floats
    """(D,) sum of the negative log densities of the true angle, per degree [nat]."""

    def __post_init__(self) -> None:
        freeze(self, within_1=("D",), within_2=("D",), within_95=("D",), sigma_deg=("D",), log_score=("D",))

    def __add__(self, other: "SigmaSums") -> "SigmaSums":
        return SigmaSums(
            self.frames + other.frames,
            self.within_1 + other.within_1,
            self.within_2 + other.within_2,
            self.within_95 + other.within_95,
            self.sigma_deg + other.sigma_deg,
            self.log_score + other.log_score,
        )

    def scores(self) -> dict[str, float]:
        """The scores of `SIGMA_DEFINITIONS` over all frames and hinges; empty without frames."""
        if not self.frames:
            return {}
        of_hinge = self.by_hinge()
        return {
            name: float(of_hinge["sigma_coverage_1"].min())
            if name == "sigma_lowest_coverage_1"
            else float(of_hinge[name].mean())
            for name in SIGMA_DEFINITIONS
        }

    def by_hinge(self) -> dict[str, Floats]:
        """Score -> (D,) values of the single hinges; empty without frames."""
        if not self.frames:
            return {}
        sums = {
            "sigma_coverage_1": self.within_1,
            "sigma_coverage_2": self.within_2,
            "sigma_coverage_95": self.within_95,
            "sigma_width_deg": self.sigma_deg,
            "sigma_log_score": self.log_score,
        }
        return {name: values / self.frames for name, values in sums.items()}


def score_sigma(truth_qpos: Floats, estimate_qpos: Floats, angle_sigma_rad: Floats) -> SigmaSums:
    """Sums over N frames of configurations (N, 55) and standard deviations (N, 48) [rad] in their order."""
    error_rad = np.abs(wrap_difference(unpack(estimate_qpos)[2] - unpack(truth_qpos)[2]))
    return sum_sigma(np.rad2deg(error_rad), np.rad2deg(in_skeleton_order(angle_sigma_rad)))


def in_skeleton_order(angle_sigma_rad: Floats) -> Floats:
    """Standard deviations (..., 48) in the order of a configuration, brought into the skeleton's order of hinges."""
    out: Floats = np.asarray(angle_sigma_rad)[..., QPOS_OF_DOF]
    return out


def sum_sigma(error_deg: Floats, sigma_deg: Floats) -> SigmaSums:
    """Sums over N frames of absolute errors (N, D) and standard deviations (N, D) [deg]; ShapeError if they differ.

    The log score is the logarithmic scoring rule for a normal density (Gneiting and Raftery 2007):
    log(sigma sqrt(2 pi)) + error^2 / (2 sigma^2).
    """
    if error_deg.shape != sigma_deg.shape:
        raise ShapeError("sum_sigma", "sigma_deg", sigma_deg.shape, str(error_deg.shape))
    share = error_deg / sigma_deg
    log_score = np.log(np.sqrt(2.0 * np.pi) * sigma_deg) + 0.5 * share**2
    return SigmaSums(
        len(error_deg),
        np.count_nonzero(share <= 1.0, axis=0).astype(float),
        np.count_nonzero(share <= 2.0, axis=0).astype(float),
        np.count_nonzero(share <= HALF_WIDTH_95, axis=0).astype(float),
        sigma_deg.sum(axis=0),
        log_score.sum(axis=0),
    )
