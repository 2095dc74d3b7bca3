"""The unknowns of the eight-pose calibration and their prior (Liu et al. 2011, eq. 1, its last term).

All poses share bones, mode weights and mounts; each pose has a root and hinges of its own (docs/calibration.md).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.body import Mount, locate_mount
from harness.calibrate.held_pose_model import MOUNT_ACROSS_SD_M, MOUNT_ALONG_SD_M
from harness.calibrate.skeleton_prior import SkeletonPrior
from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.skeleton import Skeleton

_LEAST_ACROSS_M = 1e-6
"""Directions with a smaller standard deviation than this are taken as fixed [m]."""


@dataclass(frozen=True, eq=False)
class CalibrationSolution:
    """Values of all unknowns; N bones, B modes, S stations, P poses, D hinges."""

    bone_m: Floats
    """(N, 3) bone vectors in the rest pose."""
    weights_m: Floats
    """(B,) weights of the modes: lambda of eq. 1 [m]."""
    mount_m: Floats
    """(S, 3) mounts in their bones' frames: p of eq. 1 [m]."""
    bone_from_station: Floats
    """(S, 3, 3) orientation of each station on its bone: o of eq. 1."""
    root_m: Floats
    """(P, 3) root position in each pose [m]."""
    world_from_root: Floats
    """(P, 3, 3) root orientation in each pose."""
    angles_rad: Floats
    """(P, D) hinge angles in each pose [rad]."""

    @property
    def length_m(self) -> Floats:
        """(N,) bone lengths [m]."""
        out: Floats = np.sqrt(np.sum(self.bone_m**2, axis=1))
        return out


class SharedUnknowns:
    """The X unknowns that all poses share.

    In order: G bone coordinates (along each bone's mean direction, and across it where people differ), B mode weights,
    S mounts, and S small rotations of stations in their own axes.
    """

    def __init__(self, like: Skeleton, space: SkeletonPrior, mounts: Sequence[Mount]) -> None:
        self.template, self.space, self.mounts = like, space, tuple(mounts)
        self.carriers: Ints = np.array([like.index(mount.bone) for mount in mounts], dtype=np.int64)
        vectors = np.concatenate([space.direction[:, None], space.across], axis=1)
        sd_m = np.concatenate([np.full((like.bone_count, 1), np.inf), space.across_m], axis=1)
        kept = sd_m > _LEAST_ACROSS_M
        self.bone_of: Ints = np.nonzero(kept)[0]
        self.vector: Floats = vectors[kept]
        """(G,) and (G, 3): the bone that a bone coordinate belongs to, and its direction."""
        self._coordinate_m: Floats = sd_m[kept]
        """(G,) its standard deviation; infinite along a bone, since the modes hold the prior of the length."""
        self._along = np.array([mount.along for mount in mounts])
        sizes = np.cumsum([len(self.vector), len(space.modes), 3 * len(mounts), 3 * len(mounts)])
        self.bones, self.weights, self.mount, self.turn = map(slice, (0, *sizes[:-1]), sizes)
        self.count = int(sizes[-1])

    def skin_offset_m(self, bone_m: Floats) -> Floats:
        """(S, 3) offset of the nominal mounts on the skin from bones (N, 3), for a body with these bones [m]."""
        skeleton = self.template.with_bones(bone_m)
        nominal_m = np.array([locate_mount(skeleton, mount)[0] for mount in self.mounts])
        return nominal_m - self._along[:, None] * bone_m[self.carriers]

    def nominal_m(self, bone_m: Floats, skin_offset_m: Floats) -> Floats:
        """(S, 3) nominal mounts in their bones' frames, given bones (N, 3) and skin offsets (S, 3) [m]."""
        out: Floats = self._along[:, None] * bone_m[self.carriers] + skin_offset_m
        return out

    def prior_residuals(
        self, at: CalibrationSolution, mount_spread: float, skin_offset_m: Floats
    ) -> tuple[Floats, Floats]:
        """Residuals (R,) in units of what is expected beforehand, and slopes (R, X).

        `mount_spread` is the trackers' spread about the nominal mounts in units of ALONG_M and ACROSS_M.
        """
        parts = (
            self._lengths(at),
            self._weights(at),
            self._across(at),
            self.mount_prior_residuals(at, mount_spread, skin_offset_m),
        )
        residuals, slopes = zip(*parts, strict=True)
        return np.concatenate(residuals), np.concatenate(slopes)

    def length_jacobian(self, at: CalibrationSolution) -> Floats:
        """(N, X) how bone lengths change."""
        out = np.zeros((len(at.bone_m), self.count))
        along = (at.bone_m / at.length_m[:, None])[self.bone_of]
        out[self.bone_of, np.arange(len(self.vector))] = np.sum(along * self.vector, axis=1)
        return out

    def _lengths(self, at: CalibrationSolution) -> tuple[Floats, Floats]:
        """Residual of the lengths about the modes, in standard deviations, and its Jacobian."""
        slope = self.length_jacobian(at)
        slope[:, self.weights] = -self.space.modes.T
        left_m = at.length_m - self.space.mean_m - at.weights_m @ self.space.modes
        return left_m / self.space.residual_sd_m, slope / self.space.residual_sd_m[:, None]

    def _weights(self, at: CalibrationSolution) -> tuple[Floats, Floats]:
        slope = np.zeros((len(at.weights_m), self.count))
        slope[:, self.weights] = np.diag(1.0 / self.space.mode_sd_m)
        return at.weights_m / self.space.mode_sd_m, slope

    def _across(self, at: CalibrationSolution) -> tuple[Floats, Floats]:
        """Deviation of the bones from their mean direction, in standard deviations, and its Jacobian."""
        slope = np.zeros((len(self.vector), self.count))
        slope[:, self.bones] = np.diag(1.0 / self._coordinate_m)
        return np.sum(at.bone_m[self.bone_of] * self.vector, axis=1) / self._coordinate_m, slope

    def mount_prior_residuals(
        self, at: CalibrationSolution, mount_spread: float, skin_offset_m: Floats
    ) -> tuple[Floats, Floats]:
        """Distance of mounts from nominal ones, in units of the spread `mount_spread`, and its Jacobian.

        The spread differs along and across the bones' mean directions.
        """
        along = self.space.direction[self.carriers]
        onto = along[:, :, None] * along[:, None]
        root = (
            np.eye(3) / MOUNT_ACROSS_SD_M + (1.0 / MOUNT_ALONG_SD_M - 1.0 / MOUNT_ACROSS_SD_M) * onto
        ) / mount_spread
        slope = np.zeros((len(self.mounts), 3, self.count))
        for j, bone in enumerate(self.carriers):
            coordinates = np.flatnonzero(self.bone_of == bone)
            slope[j][:, coordinates] = -self._along[j] * self.vector[coordinates].T
            slope[j][:, self.mount][:, 3 * j : 3 * j + 3] = np.eye(3)
        off_m = at.mount_m - self.nominal_m(at.bone_m, skin_offset_m)
        return (root @ off_m[..., None]).ravel(), (root @ slope).reshape(-1, self.count)


def apply_step(
    at: CalibrationSolution, shared: SharedUnknowns, step: Floats, pose_step: Floats, hinges: Ints
) -> CalibrationSolution:
    """A solution plus one step of the shared unknowns (X,) and of each pose's root and hinges (P, 6 + H)."""
    angles_rad = np.array(at.angles_rad)
    angles_rad[:, hinges] += pose_step[:, 6:]
    bone_m = np.array(at.bone_m)
    np.add.at(bone_m, shared.bone_of, step[shared.bones, None] * shared.vector)
    return CalibrationSolution(
        bone_m=bone_m,
        weights_m=at.weights_m + step[shared.weights],
        mount_m=at.mount_m + step[shared.mount].reshape(-1, 3),
        bone_from_station=at.bone_from_station @ _rotation_matrices(step[shared.turn].reshape(-1, 3)),
        root_m=at.root_m + pose_step[:, :3],
        world_from_root=_rotation_matrices(pose_step[:, 3:6]) @ at.world_from_root,
        angles_rad=angles_rad,
    )


def _rotation_matrices(vectors_rad: Floats) -> Floats:
    return rotations.to_matrix(rotations.exp(vectors_rad))
