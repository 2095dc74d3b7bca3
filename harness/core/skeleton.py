"""A skeleton of bones with hinge joints, its hinge angles, and its forward kinematics in plain numpy.

World axes everywhere: x forward, y left, z up, metres. In the rest pose (all angles zero, root unrotated)
every bone's frame is parallel to the world. A bone's rotation relative to its parent is the product of its
hinges, the last named one outermost: R = R(c) R(b) R(a) for hinges (a, b, c), as Acclaim files compose them.

Three orthogonal hinges reach any rotation (closed-form Euler angles), each by two sets of angles; see
`equivalent_euler_angles`. One or two hinges give the nearest rotation: the one whose quaternion has the largest inner
product with the wanted quaternion. That product is bilinear in the half-angle vectors (cos, sin), so the best angles
are the leading singular vectors of a matrix of at most 2 x 2.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, Ints, freeze
from harness.errors import UnknownName


@dataclass(frozen=True, eq=False)
class Skeleton:
    """B bones, parents before children, with D hinges in bone order."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    """Index of each bone's parent; -1 is the root."""
    bone_m: Floats
    """(B, 3) from the bone's joint to its far end, in the rest pose [m]."""
    hinges: tuple[tuple[str, ...], ...]
    """Channel names of each bone, such as ("rx", "ry", "rz"), innermost first; () for a rigid bone."""
    axes: Floats
    """(D, 3) unit axis of each hinge in the rest pose."""

    def __post_init__(self) -> None:
        freeze(self, bone_m=("B", 3), axes=("D", 3))

    @property
    def bone_count(self) -> int:
        return len(self.names)

    @cached_property
    def dof_names(self) -> tuple[str, ...]:
        """(D,) hinge names, such as "lfemur.rx"."""
        return tuple(f"{n}.{c}" for n, channels in zip(self.names, self.hinges, strict=True) for c in channels)

    @cached_property
    def dof_of_bone(self) -> tuple[slice, ...]:
        """(B,) slice of each bone's hinges among the D."""
        ends = np.cumsum([len(channels) for channels in self.hinges])
        return tuple(slice(int(e) - len(c), int(e)) for e, c in zip(ends, self.hinges, strict=True))

    @cached_property
    def length_m(self) -> Floats:
        """(B,) bone lengths [m]."""
        out: Floats = np.sqrt(np.sum(self.bone_m**2, axis=1))
        return out

    def index(self, bone: str) -> int:
        """Index of a bone; UnknownName if there is none of that name."""
        if bone not in self.names:
            raise UnknownName("bone", bone, self.names)
        return self.names.index(bone)

    def subset(self, names: Sequence[str]) -> tuple["Skeleton", Ints]:
        """The skeleton with only these bones (closed under parents), and the (D',) hinges that it keeps."""
        kept = [self.index(name) for name in names]
        place = {-1: -1} | {old: new for new, old in enumerate(kept)}
        dofs = np.array(
            [d for b in kept for d in range(self.dof_of_bone[b].start, self.dof_of_bone[b].stop)], dtype=int
        )
        small = Skeleton(
            names=tuple(names),
            parents=tuple(place[self.parents[b]] for b in kept),
            bone_m=self.bone_m[kept],
            hinges=tuple(self.hinges[b] for b in kept),
            axes=self.axes[dofs],
        )
        return small, dofs

    def with_bones(self, bone_m: Floats) -> "Skeleton":
        """A copy with other bone vectors (B, 3) [m] and the same joints."""
        return Skeleton(self.names, self.parents, bone_m, self.hinges, self.axes)


@dataclass(frozen=True, eq=False)
class BodyGeom:
    """One geom of the body, in the frame of its bone."""

    bone: str
    """Name of the bone, or "root"."""
    name: str
    kind: str
    """`capsule` (along its z; size: radius, half length, 0) or `ellipsoid` (size: half axes)."""
    centre_m: Floats
    """(3,) [m]."""
    bone_from_shape: Floats
    """(4,) unit quaternion."""
    size_m: Floats
    """(3,) [m]; see `kind`."""
    mass_kg: float

    def __post_init__(self) -> None:
        freeze(self, centre_m=(3,), bone_from_shape=(4,), size_m=(3,))


@dataclass(frozen=True, eq=False)
class Pose:
    """Positions and rotations of B bones in T frames, in the world."""

    start_m: Floats
    """(T, B, 3) position of the joint that each bone turns about [m]."""
    end_m: Floats
    """(T, B, 3) position of each bone's far end [m]."""
    world_from_bone: Floats
    """(T, B, 3, 3) rotation matrices."""


def forward_kinematics(skeleton: Skeleton, root_m: Floats, world_from_root: Floats, angles_rad: Floats) -> Pose:
    """Forward kinematics of T frames: root position (T, 3), root quaternion (T, 4), hinge angles (T, D)."""
    return pose_from_rotations(skeleton, root_m, world_rotations(skeleton, world_from_root, angles_rad))


def world_rotations(skeleton: Skeleton, world_from_root: Floats, angles_rad: Floats) -> Floats:
    """(T, B, 3, 3) rotations `world_from_bone`, which do not depend on the root's position.

    They are the most expensive part of the forward kinematics.
    """
    root = rotations.to_matrix(world_from_root)
    out = np.empty((len(angles_rad), skeleton.bone_count, 3, 3))
    for b, parent in enumerate(skeleton.parents):
        above = root if parent < 0 else out[:, parent]
        out[:, b] = above @ local_rotation(skeleton, b, angles_rad)
    return out


def pose_from_rotations(skeleton: Skeleton, root_m: Floats, world_from_bone: Floats) -> Pose:
    """The pose of bones with rotations (T, B, 3, 3) on a root at positions (T, 3) [m]."""
    start = np.empty(world_from_bone.shape[:3])
    end = np.empty_like(start)
    for b, parent in enumerate(skeleton.parents):
        start[:, b] = root_m if parent < 0 else end[:, parent]
        end[:, b] = start[:, b] + world_from_bone[:, b] @ skeleton.bone_m[b]
    return Pose(start, end, world_from_bone)


def local_rotation(skeleton: Skeleton, bone: int, angles_rad: Floats) -> Floats:
    """(T, 3, 3) rotation of one bone relative to its parent."""
    turn = np.broadcast_to(np.eye(3), (len(angles_rad), 3, 3))
    where = skeleton.dof_of_bone[bone]
    for d in range(where.start, where.stop):
        turn = rotations.to_matrix(rotations.exp(angles_rad[:, d, None] * skeleton.axes[d])) @ turn
    return turn


_POLE_MARGIN_RAD = np.deg2rad(10.0)
"""A track may pass a gimbal's pole by this much, as the joint limits of `core.humanoid24` do [rad]."""


def unwrap_angles(skeleton: Skeleton, angles_rad: Floats) -> Floats:
    """Angles (T, D) of the same rotations, continuous and on the near branch of each gimbal.

    Files wrap at 180 deg, and three hinges (a, b, c) have the equivalent angles (a + pi, pi - b, c + pi)
    (docs/notes/traps.md F9). The near branch is the one with b within 90 deg, where joint limits hold and solvers
    answer. A track past the pole by at most `_POLE_MARGIN_RAD` stays continuous. One that goes farther jumps to the
    near branch at the pole: it would otherwise be on the far branch until it passes the pole again. Between jumps
    columns are unwrapped, and shifted by whole turns so that their medians lie in (-pi, pi].
    """
    out = np.array(angles_rad, dtype=float)
    for where in skeleton.dof_of_bone:
        if are_gimbal(skeleton.axes[where]):
            out[:, where] = _unwrap_gimbal(out[:, where])
        else:
            out[:, where] = _centre_on_zero(np.unwrap(out[:, where], axis=0))
    return out


def _unwrap_gimbal(angles_rad: Floats) -> Floats:
    """`unwrap_angles` for the angles (T, 3) of one gimbal, T >= 1."""
    is_near = np.cos(angles_rad[:, 1]) >= 0.0
    near = np.where(is_near[:, None], angles_rad, equivalent_euler_angles(angles_rad))
    far = equivalent_euler_angles(near)
    crosses = _wrapped_squared(far[1:] - near[:-1]) < _wrapped_squared(near[1:] - near[:-1])
    run = np.concatenate([[0], np.cumsum(crosses)])
    deepest = np.maximum.reduceat(np.cos(near[:, 1]), np.flatnonzero(np.diff(run, prepend=-1)))
    # A run of frames between two crossings that stays close to the pole continues the last run that does not.
    deep = deepest > np.sin(_POLE_MARGIN_RAD)
    base = np.maximum.accumulate(np.where(deep, np.arange(len(deep)), 0))
    on_far = (run - base[run]) % 2 == 1
    out = np.where(on_far[:, None], far, near)
    stretches = np.split(out, 1 + np.flatnonzero(crosses & (on_far[1:] == on_far[:-1])))
    return np.concatenate([_centre_on_zero(np.unwrap(stretch, axis=0)) for stretch in stretches])


def _wrapped_squared(difference_rad: Floats) -> Floats:
    """Squared size (...,) of differences (..., 3) of angles, each taken the short way round."""
    out: Floats = np.sum((difference_rad - 2 * np.pi * np.round(difference_rad / (2 * np.pi))) ** 2, axis=-1)
    return out


def _centre_on_zero(angles_rad: Floats) -> Floats:
    """Columns (T, N) shifted by whole turns so that each median lies in (-pi, pi]."""
    out: Floats = angles_rad - 2 * np.pi * np.ceil(np.median(angles_rad, axis=0) / (2 * np.pi) - 0.5)
    return out


def hinge_angles(axes: Floats, parent_from_bone: Floats) -> Floats:
    """Angles (T, N) [rad] of N <= 3 orthogonal hinges (innermost first) whose rotations are nearest to (T, 4)."""
    if len(axes) == 3:
        return _euler(axes, parent_from_bone)
    w, v = parent_from_bone[:, :1], parent_from_bone[:, 1:]
    if len(axes) == 0:
        return np.zeros((len(v), 0))
    along: Floats = v @ axes.T
    if len(axes) == 1:
        return 2.0 * np.arctan2(along, w)
    both: Floats = v @ np.cross(axes[1], axes[0])
    product = np.stack([np.concatenate([w, along[:, :1]], -1), np.stack([along[:, 1], both], -1)], -2)
    outer, _, inner = np.linalg.svd(product)
    return 2.0 * np.stack([np.arctan2(inner[:, 0, 1], inner[:, 0, 0]), np.arctan2(outer[:, 1, 0], outer[:, 0, 0])], -1)


def hinge_rotation(axes: Floats, angles_rad: Floats) -> Floats:
    """Quaternions (T, 4) of hinges (N, 3) at angles (T, N) [rad], innermost first."""
    out = np.broadcast_to(rotations.IDENTITY, (len(angles_rad), 4))
    for k, axis in enumerate(axes):
        out = rotations.multiply(rotations.exp(angles_rad[:, k, None] * axis), out)
    return out


def _euler(axes: Floats, parent_from_bone: Floats) -> Floats:
    """Angles (T, 3) a, b, c of R = R(c) R(b) R(a) about right-handed orthogonal axes.

    Where b is +-90 deg only a + c or a - c is determined, and a is 0.
    """
    m = axes @ rotations.to_matrix(parent_from_bone) @ axes.T
    b = np.arctan2(-m[:, 2, 0], np.hypot(m[:, 2, 1], m[:, 2, 2]))
    locked = np.hypot(m[:, 2, 1], m[:, 2, 2]) < 1e-9
    a = np.where(locked, 0.0, np.arctan2(m[:, 2, 1], m[:, 2, 2]))
    c = np.where(locked, np.arctan2(-m[:, 0, 1], m[:, 1, 1]), np.arctan2(m[:, 1, 0], m[:, 0, 0]))
    return np.stack([a, b, c], axis=-1)


def are_gimbal(axes: Floats) -> bool:
    """Whether the axes (N, 3) are three and orthogonal."""
    return len(axes) == 3 and bool(np.allclose(axes @ axes.T, np.eye(3), atol=1e-9))


def equivalent_euler_angles(angles_rad: Floats) -> Floats:
    """Second set of angles (..., 3) of three orthogonal hinges for the same rotation."""
    out: Floats = angles_rad * [1.0, -1.0, 1.0] + np.pi
    return out
