"""What eight poses are to tell: bones, mode weights and mounts, which all poses share, and each pose's own root and
hinges; and what is expected of the shared ones beforehand (Liu et al. 2011, eq. 1, its last term; docs/methods.md H15).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.body.mounts import Mount, locate_mount
from harness.calibrate.skeleton_prior import SkeletonPrior
from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.skeleton import Skeleton

MOUNT_ALONG_SD_M, MOUNT_ACROSS_SD_M = 0.03, 0.015
"""How far trackers sit from their nominal mounts, standard deviation along the bone and on the two axes across it, as
`stance` has it; here the spread of the very trackers that are worn is estimated in units of it."""
_LEAST_ACROSS_M = 1e-6
"""Bones that point so much alike in all people point the same."""


@dataclass(frozen=True, eq=False)
class CalibrationSolution:
    """Values of everything that is sought; N bones, B modes, S stations, P poses, D hinges."""

    bone_m: Floats
    """(N, 3) bone vectors in the rest pose."""
    weights_m: Floats
    """(B,) of the modes: lambda of eq. 1."""
    mount_m: Floats
    """(S, 3) p of eq. 1."""
    bone_from_station: Floats
    """(S, 3, 3) o of eq. 1."""
    root_m: Floats
    """(P, 3)"""
    world_from_root: Floats
    """(P, 3, 3)"""
    angles_rad: Floats
    """(P, D)"""

    @property
    def length_m(self) -> Floats:
        """(N,)"""
        out: Floats = np.sqrt(np.sum(self.bone_m**2, axis=1))
        return out


class SharedUnknowns:
    """The X unknowns that all poses share: G bone coordinates (along each bone's mean direction, and across it where
    people differ), B mode weights, then S mounts and S small turns of stations in their own axes."""

    def __init__(self, like: Skeleton, space: SkeletonPrior, mounts: Sequence[Mount]) -> None:
        self.template, self.space, self.mounts = like, space, tuple(mounts)
        self.carriers: Ints = np.array([like.index(mount.bone) for mount in mounts], dtype=np.int64)
        vectors = np.concatenate([space.direction[:, None], space.across], axis=1)
        spread_m = np.concatenate([np.full((like.bone_count, 1), np.inf), space.across_m], axis=1)
        kept = spread_m > _LEAST_ACROSS_M
        self.bone_of: Ints = np.nonzero(kept)[0]
        self.vector: Floats = vectors[kept]
        """(G,) and (G, 3): the bone that a bone coordinate adds to, and along what."""
        self._coordinate_m: Floats = spread_m[kept]
        """(G,) its standard deviation; infinite along a bone, of which the modes know."""
        self._along = np.array([mount.along for mount in mounts])
        sizes = np.cumsum([len(self.vector), len(space.modes), 3 * len(mounts), 3 * len(mounts)])
        self.bones, self.weights, self.mount, self.turn = map(slice, (0, *sizes[:-1]), sizes)
        self.count = int(sizes[-1])

    def flesh_m(self, bone_m: Floats) -> Floats:
        """(S, 3) from the bones (N, 3) to the nominal mounts on the skin: of a body with these bones."""
        skeleton = self.template.with_bones(bone_m)
        nominal_m = np.array([locate_mount(skeleton, mount)[0] for mount in self.mounts])
        return nominal_m - self._along[:, None] * bone_m[self.carriers]

    def nominal_m(self, bone_m: Floats, flesh_m: Floats) -> Floats:
        """(S, 3) nominal mounts."""
        out: Floats = self._along[:, None] * bone_m[self.carriers] + flesh_m
        return out

    def prior_residuals(self, at: CalibrationSolution, beside: float, flesh_m: Floats) -> tuple[Floats, Floats]:
        """Residuals (R,) in units of what is expected beforehand, and slopes (R, X).

        `beside` is the trackers' spread about the nominal mounts in units of ALONG_M and ACROSS_M.
        """
        parts = self._lengths(at), self._weights(at), self._across(at), self.mount_prior_residuals(at, beside, flesh_m)
        residuals, slopes = zip(*parts, strict=True)
        return np.concatenate(residuals), np.concatenate(slopes)

    def length_slope(self, at: CalibrationSolution) -> Floats:
        """(N, X) how bone lengths change."""
        out = np.zeros((len(at.bone_m), self.count))
        along = (at.bone_m / at.length_m[:, None])[self.bone_of]
        out[self.bone_of, np.arange(len(self.vector))] = np.sum(along * self.vector, axis=1)
        return out

    def _lengths(self, at: CalibrationSolution) -> tuple[Floats, Floats]:
        """What the modes leave of the lengths."""
        slope = self.length_slope(at)
        slope[:, self.weights] = -self.space.modes.T
        left_m = at.length_m - self.space.mean_m - at.weights_m @ self.space.modes
        return left_m / self.space.rest_m, slope / self.space.rest_m[:, None]

    def _weights(self, at: CalibrationSolution) -> tuple[Floats, Floats]:
        slope = np.zeros((len(at.weights_m), self.count))
        slope[:, self.weights] = np.diag(1.0 / self.space.spread_m)
        return at.weights_m / self.space.spread_m, slope

    def _across(self, at: CalibrationSolution) -> tuple[Floats, Floats]:
        """How far bones point from the mean direction."""
        slope = np.zeros((len(self.vector), self.count))
        slope[:, self.bones] = np.diag(1.0 / self._coordinate_m)
        return np.sum(at.bone_m[self.bone_of] * self.vector, axis=1) / self._coordinate_m, slope

    def mount_prior_residuals(self, at: CalibrationSolution, beside: float, flesh_m: Floats) -> tuple[Floats, Floats]:
        """How far trackers sit from their nominal mounts on these bones, along bones as they point on average, and
        across."""
        along = self.space.direction[self.carriers]
        onto = along[:, :, None] * along[:, None]
        root = (np.eye(3) / MOUNT_ACROSS_SD_M + (1.0 / MOUNT_ALONG_SD_M - 1.0 / MOUNT_ACROSS_SD_M) * onto) / beside
        slope = np.zeros((len(self.mounts), 3, self.count))
        for j, bone in enumerate(self.carriers):
            own = np.flatnonzero(self.bone_of == bone)
            slope[j][:, own] = -self._along[j] * self.vector[own].T
            slope[j][:, self.mount][:, 3 * j : 3 * j + 3] = np.eye(3)
        off_m = at.mount_m - self.nominal_m(at.bone_m, flesh_m)
        return (root @ off_m[..., None]).ravel(), (root @ slope).reshape(-1, self.count)


def apply_step(
    at: CalibrationSolution, shared: SharedUnknowns, step: Floats, own: Floats, hinges: Ints
) -> CalibrationSolution:
    """One step of what is shared (X,) and of each pose's root and these hinges (P, 6 + H) from a solution."""
    angles_rad = np.array(at.angles_rad)
    angles_rad[:, hinges] += own[:, 6:]
    bone_m = np.array(at.bone_m)
    np.add.at(bone_m, shared.bone_of, step[shared.bones, None] * shared.vector)
    return CalibrationSolution(
        bone_m=bone_m,
        weights_m=at.weights_m + step[shared.weights],
        mount_m=at.mount_m + step[shared.mount].reshape(-1, 3),
        bone_from_station=at.bone_from_station @ _rotation_matrices(step[shared.turn].reshape(-1, 3)),
        root_m=at.root_m + own[:, :3],
        world_from_root=_rotation_matrices(own[:, 3:6]) @ at.world_from_root,
        angles_rad=angles_rad,
    )


def _rotation_matrices(vectors_rad: Floats) -> Floats:
    return rotations.to_matrix(rotations.exp(vectors_rad))
