"""What a 3-D file shows of a body besides its bones: the surface, as triangles, and the stations worn on it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, Ints, freeze
from harness.core.skeleton import BodyGeom
from harness.mocap.write.posed_motion import ExportableCell, PosedMotion

_STICK_RADIUS_M = 0.03


@dataclass(frozen=True, eq=False)
class MountedStation:
    """Place of a station in the frame of its bone."""

    name: str
    bone: str
    position_m: Floats
    """(3,) [m]."""
    bone_from_station: Floats
    """(4,) unit quaternion (w, x, y, z)."""

    def __post_init__(self) -> None:
        freeze(self, position_m=(3,), bone_from_station=(4,))


@dataclass(frozen=True)
class BodyModel:
    """Surface and stations of one body."""

    shapes: Sequence[BodyGeom]
    stations: Sequence[MountedStation] = ()


def stick_figure(cell: ExportableCell, motion: PosedMotion) -> BodyModel:
    """A model with a thin capsule from end to end of each bone, and without stations."""
    skeleton = motion.skeleton
    return BodyModel([_stick(name, vector) for name, vector in zip(skeleton.names, skeleton.bone_m, strict=True)])


def _stick(bone: str, vector_m: Floats) -> BodyGeom:
    length_m = float(np.linalg.norm(vector_m))
    turn = np.array([length_m + vector_m[2], -vector_m[1], vector_m[0], 0.0])
    size = float(np.linalg.norm(turn))
    bone_from_shape = turn / size if size > 0.0 else np.array([0.0, 1.0, 0.0, 0.0])
    return BodyGeom(
        bone, bone, "capsule", 0.5 * vector_m, bone_from_shape, np.array([_STICK_RADIUS_M, 0.5 * length_m, 0.0]), 0.0
    )


_SECTORS, _RINGS = 16, 6
"""Number of vertices around a shape, and of rings from pole to equator."""


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """V vertices and N triangles, whose vertices run counter-clockwise seen from outside."""

    position_m: Floats
    """(V, 3) [m]."""
    normal: Floats
    """(V, 3) outward unit vectors."""
    triangles: Ints
    """(N, 3) indices of vertices."""


def tessellate_shape(shape: BodyGeom) -> TriangleMesh:
    """The surface of a shape in the frame of its bone."""
    capsule = shape.kind == "capsule"
    latitude = np.linspace(0.5 * np.pi, 0.0, _RINGS)
    # the equator of a capsule is there twice, at both ends of its cylinder
    latitude = np.concatenate([latitude, -latitude[::-1] if capsule else -latitude[-2::-1]])
    longitude = np.arange(_SECTORS) * (2.0 * np.pi / _SECTORS)
    unit = np.stack(
        np.broadcast_arrays(
            np.cos(latitude)[:, None] * np.cos(longitude),
            np.cos(latitude)[:, None] * np.sin(longitude),
            np.sin(latitude)[:, None],
        ),
        axis=-1,
    )
    axes = np.full(3, shape.size_m[0]) if capsule else shape.size_m
    position = unit * axes
    if capsule:
        position[:_RINGS, :, 2] += shape.size_m[1]
        position[_RINGS:, :, 2] -= shape.size_m[1]
    normal = unit / axes
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    turn = rotations.to_matrix(shape.bone_from_shape)
    return TriangleMesh(
        position.reshape(-1, 3) @ turn.T + shape.centre_m,
        normal.reshape(-1, 3) @ turn.T,
        _ring_triangles(len(latitude)),
    )


def tessellate_box(size_m: Floats) -> TriangleMesh:
    """A box about the origin with sides (3,) [m]; each face has four vertices of its own, so that edges look sharp."""
    faces = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            outward, across = np.eye(3)[axis] * sign, np.eye(3)[(axis + 1) % 3]
            up = np.cross(outward, across)
            corners = [outward + a * across + b * up for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            triangles = np.array([(0, 1, 2), (0, 2, 3)])
            faces.append(TriangleMesh(0.5 * size_m * np.array(corners), np.tile(outward, (4, 1)), triangles))
    return merge_meshes(faces)


def merge_meshes(meshes: list[TriangleMesh]) -> TriangleMesh:
    """One mesh with the triangles of all."""
    first = np.cumsum([0, *(len(mesh.position_m) for mesh in meshes[:-1])])
    return TriangleMesh(
        np.concatenate([mesh.position_m for mesh in meshes]),
        np.concatenate([mesh.normal for mesh in meshes]),
        np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, first, strict=True)]),
    )


def _ring_triangles(rings: int) -> Ints:
    """Triangles between rings from pole to pole; all vertices of the first and of the last ring lie in one place."""
    sector = np.arange(_SECTORS)
    after = (sector + 1) % _SECTORS
    triangles = []
    for ring in range(rings - 1):
        above, below = ring * _SECTORS, (ring + 1) * _SECTORS
        if ring < rings - 2:
            triangles.append(np.stack([above + sector, below + sector, below + after], axis=1))
        if ring > 0:
            triangles.append(np.stack([above + sector, below + after, above + after], axis=1))
    return np.concatenate(triangles)
