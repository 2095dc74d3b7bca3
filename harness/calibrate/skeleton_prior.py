"""Prior of people's bones: PCA of bone lengths over a population of skeletons (Liu et al. 2011, section 3).

See docs/papers.md A2 and docs/calibration.md. Lengths are in metres, not divided by the left tibia as in the paper's
figure. Every skeleton counts twice, as it is and mirrored, so the prior is symmetric. The residual of the modes is
normal and independent for each bone. The directions of bones in the rest pose have a normal distribution as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats, Ints, freeze
from harness.core.skeleton import Skeleton
from harness.errors import BadInput

LEAST_RESIDUAL_SD_M = 1e-3
"""Smallest residual standard deviation of a bone's length [m] [choice]."""


@dataclass(frozen=True, eq=False)
class SkeletonPrior:
    """Normal distribution of the lengths and directions of N bones, with B modes of the lengths."""

    mean_m: Floats
    """(N,) mean lengths [m]."""
    modes: Floats
    """(B, N) orthonormal principal directions of the lengths."""
    mode_sd_m: Floats
    """(B,) standard deviation of each mode's weight [m]."""
    residual_sd_m: Floats
    """(N,) standard deviation of each length about the modes [m]."""
    direction: Floats
    """(N, 3) mean direction of each bone in the rest pose, unit vectors."""
    across: Floats
    """(N, 2, 3) two unit vectors orthogonal to it."""
    across_m: Floats
    """(N, 2) standard deviation of the bone's far end along these [m]; 0 where all people's bones are parallel."""
    source: str
    """Name of the population, for tables."""

    def __post_init__(self) -> None:
        freeze(self, mean_m=("N",), modes=("B", "N"), mode_sd_m=("B",), residual_sd_m=("N",))
        freeze(self, direction=("N", 3), across=("N", 2, 3), across_m=("N", 2))

    @property
    def covariance_m2(self) -> Floats:
        """(N, N) covariance of the lengths [m^2]."""
        out: Floats = (self.modes.T * self.mode_sd_m**2) @ self.modes + np.diag(self.residual_sd_m**2)
        return out

    def mean_skeleton(self, like: Skeleton) -> Skeleton:
        """Skeleton of mean bone lengths and directions, with the hinges of another skeleton."""
        return like.with_bones(self.mean_m[:, None] * self.direction)


def fit_skeleton_prior(skeletons: Sequence[Skeleton], modes: int = 5, source: str = "") -> SkeletonPrior:
    """Fit the prior to a population of skeletons; BadInput for fewer people than modes + 2 or for unlike bones."""
    count = len(skeletons)
    if modes < 0 or count < modes + 2:
        raise BadInput(
            f"{count} skeletons are too few for {modes} modes of bone lengths.",
            f"Take {modes + 2} or more, or fewer modes.",
        )
    names = skeletons[0].names
    if any(skeleton.names != names for skeleton in skeletons):
        raise BadInput("The skeletons have different bones.", "Retarget them to the 24 bones first.")
    bone_m = np.array([skeleton.bone_m for skeleton in skeletons])
    both_m = np.concatenate([bone_m, bone_m[:, _mirrored_bones(names)] * [1.0, -1.0, 1.0]])
    length_m = np.sqrt(np.sum(both_m**2, axis=2))
    mean_m = length_m.mean(axis=0)
    _, size, rows = np.linalg.svd(length_m - mean_m, full_matrices=False)
    variance = size**2 / (2.0 * (count - 1))
    total_variance = np.sum((length_m - mean_m) ** 2, axis=0) / (2.0 * (count - 1))
    # Modes overfit the people that they come from; the factor corrects the residual for other people.
    residual_variance = (total_variance - variance[:modes] @ rows[:modes] ** 2) * count / (count - modes)
    direction, across, across_m = _directions(both_m, count)
    return SkeletonPrior(
        mean_m=mean_m,
        modes=rows[:modes],
        mode_sd_m=np.sqrt(variance[:modes]),
        residual_sd_m=np.sqrt(np.maximum(residual_variance, LEAST_RESIDUAL_SD_M**2)),
        direction=direction,
        across=across,
        across_m=across_m,
        source=source,
    )


def _directions(both_m: Floats, count: int) -> tuple[Floats, Floats, Floats]:
    """Mean directions (N, 3), principal axes across them (N, 2, 3), standard deviations along these (N, 2) [m]."""
    mean = both_m.mean(axis=0)
    direction = mean / np.sqrt(np.sum(mean**2, axis=1, keepdims=True))
    along = np.einsum("kbi,bi->kb", both_m, direction)
    off = np.swapaxes(both_m - along[:, :, None] * direction, 0, 1)
    # The direction is added as a dominant axis, so that the next two are orthogonal to it.
    _, size, axes = np.linalg.svd(np.concatenate([off, 1e3 * direction[:, None]], axis=1), full_matrices=False)
    return direction, axes[:, 1:], size[:, 1:] / np.sqrt(2.0 * (count - 1))


def _mirrored_bones(names: Sequence[str]) -> Ints:
    """(N,) index of the bone on the other side; a bone of the middle is its own mirror image."""
    swap = {"l": "r", "r": "l"}
    twins = [swap.get(name[0], "") + name[1:] for name in names]
    return np.array([names.index(twin) if twin in names else b for b, twin in enumerate(twins)], dtype=np.int64)
