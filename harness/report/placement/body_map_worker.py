"""The process that renders a body in colours: `python -m harness.report.placement.body_map_worker JOB.npz OUT.npz`.

Started by `harness.report.placement.body_map` in a process of its own, for VTK without a working OpenGL may end it. The body
stands in the T-pose; each point of the skin has the colour of the places on its own bone.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from harness.body.anatomy import BodyGeom, body_geoms
from harness.body.humanoid import tpose
from harness.body.mounts import Mount, locate_mount
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.files import write_npz
from harness.core.humanoid24 import standard_skeleton, unpack
from harness.core.skeleton import Skeleton, forward_kinematics
from harness.report.placement.body_map import interpolate_colours

SIZE = (760, 740)
"""Of one view, width and height in pixels."""
_SUPERSAMPLING = 2
"""Times so many are rendered and averaged, for a picture without background is not smoothed."""
NEUTRAL_COLOUR = (0.74, 0.76, 0.79)
"""Skin of bones on which no place was tried."""
_BASE_COLOUR = "#3a4250"
"""Balls that have no value: what is worn already."""
_VIEW_HEIGHT_M = 1.86
"""Of what a view shows."""
_RIMS = ((0.030, "#16191d"), (0.026, "#ffffff"))
"""Radius [m] and colour of the rims around a ball."""
_BALL_M = 0.019
_PELVIS = ("root", "lhipjoint", "rhipjoint")
"""Rigid with each other: one skin."""


def main(job: str, output: str) -> None:
    """Pictures (2, height, width, 4) from ahead and from behind, and where the places are on them (2, N, 3): across and
    down [px], and how much they face the camera."""
    with np.load(job, allow_pickle=False) as content:
        mounts = [
            Mount(str(n), str(bone), float(along), float(around), float(off))
            for n, (bone, along, around, off) in enumerate(
                zip(content["bone"], content["along"], content["around_rad"], content["stand_off_m"], strict=True)
            )
        ]
        colour, known = content["colour"], content["known"]
    skeleton = standard_skeleton()
    standing = _TPose(skeleton)
    at_m, outward = _mount_positions(skeleton, standing, mounts)
    bones = [mount.bone for mount in mounts]
    body = [_coloured_mesh(standing, shape, bones, at_m, colour, known) for shape in body_geoms(skeleton)]
    views = _views(body, at_m, outward, colour, known)
    write_npz(Path(output), picture=np.array([p for p, _ in views]), at=np.array([a for _, a in views]))


class _TPose:
    """Where the bones of a body in the T-pose are."""

    def __init__(self, skeleton: Skeleton) -> None:
        root_m, turned, angles = unpack(tpose(skeleton)[None])
        pose = forward_kinematics(skeleton, root_m, turned, angles)
        self._root = root_m[0], rotations.to_matrix(turned[0])
        self._bones = dict(zip(skeleton.names, zip(pose.start_m[0], pose.world_from_bone[0], strict=True), strict=True))

    def joint_pose(self, bone: str) -> tuple[Floats, Floats]:
        """Joint (3,) [m] and rotation (3, 3) of a bone, or of the root."""
        return self._bones.get(bone, self._root)


def _mount_positions(skeleton: Skeleton, standing: _TPose, mounts: list[Mount]) -> tuple[Floats, Floats]:
    """(N, 3) where the skin under each mount is in the room, and (N, 3) which way it faces."""
    at_m, outward = np.empty((len(mounts), 3)), np.empty((len(mounts), 3))
    for n, mount in enumerate(mounts):
        start_m, turn = standing.joint_pose(mount.bone)
        local_m, bone_from_station = locate_mount(skeleton, mount)
        at_m[n] = start_m + turn @ local_m
        outward[n] = turn @ rotations.rotate(bone_from_station, np.array([0.0, 0.0, 1.0]))
    return at_m, outward


def _coloured_mesh(
    standing: _TPose, shape: BodyGeom, bones: list[str], at_m: Floats, colour: Floats, known: Floats
) -> "pv.PolyData":
    """One part of the body, each point in the colour of the places of its bone."""
    mesh = _mesh(shape)
    mesh.points = np.asarray(mesh.points) @ rotations.to_matrix(shape.bone_from_shape).T + shape.centre_m
    start_m, turn = standing.joint_pose(shape.bone)
    mesh.points = np.asarray(mesh.points) @ turn.T + start_m
    carriers = _PELVIS if shape.bone in _PELVIS else (shape.bone,)
    mine = np.array([n for n, bone in enumerate(bones) if bone in carriers and known[n]], dtype=int)
    mesh["colour"] = np.tile(NEUTRAL_COLOUR, (mesh.n_points, 1))
    if len(mine):
        mesh["colour"] = interpolate_colours(np.asarray(mesh.points, dtype=float), at_m[mine], colour[mine])
    return mesh


def _mesh(shape: BodyGeom) -> "pv.PolyData":
    """A capsule along z, or an ellipsoid, with points close enough to take colours."""
    half = float(shape.size_m[1]) if shape.kind == "capsule" else 0.0
    radii = np.full(3, shape.size_m[0]) if shape.kind == "capsule" else shape.size_m
    turn, rise = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 32), np.linspace(0.0, 1.0, 16 if half else 1)
    around = np.linspace(0.0, 2.0 * np.pi, 45)
    # The lower cap, what lies between, and the upper cap: how wide it is there, and how high.
    wide = np.concatenate([np.cos(turn[:16]), np.ones(len(rise)), np.cos(turn[16:])])
    high = np.concatenate(
        [radii[2] * np.sin(turn[:16]) - half, half * (2.0 * rise - 1.0), radii[2] * np.sin(turn[16:]) + half]
    )
    x, y = (radii[k] * np.outer(wide, swing(around)) for k, swing in enumerate((np.cos, np.sin)))
    surface = pv.StructuredGrid(x, y, np.outer(high, np.ones_like(around))).extract_surface(algorithm=None)
    mesh: pv.PolyData = surface.triangulate().clean(tolerance=1e-6)
    return mesh


def _views(
    body: "list[pv.PolyData]", at_m: Floats, outward: Floats, colour: Floats, known: Floats
) -> list[tuple[np.ndarray, Floats]]:
    """The picture from ahead and the one from behind, each with where the places are on it."""
    plotter: Any = pv.Plotter(off_screen=True, window_size=[_SUPERSAMPLING * side for side in SIZE], lighting="none")
    whole = body[0].append_polydata(*body[1:])
    low, high = whole.bounds[4:6]
    middle = np.array([0.0, 0.0, 0.5 * (low + high)])
    try:
        look = {"ambient": 0.62, "diffuse": 0.45, "specular": 0.0, "smooth_shading": True}
        plotter.add_mesh(whole, scalars="colour", rgb=True, **look)
        for at, way, shade, there in zip(at_m, outward, colour, known, strict=True):
            centre = at + 0.5 * _BALL_M * way
            for radius, rim in _RIMS:
                ball = pv.Sphere(radius=radius, center=centre)
                plotter.add_mesh(ball, color=rim, culling="front", lighting=False)
            plotter.add_mesh(pv.Sphere(radius=_BALL_M, center=centre), color=shade if there else _BASE_COLOUR, **look)
        plotter.enable_parallel_projection()
        plotter.camera.parallel_scale = 0.5 * _VIEW_HEIGHT_M
        return [_view(plotter, middle, at_m, outward, towards) for towards in (1.0, -1.0)]
    finally:
        plotter.close()


def _view(plotter: Any, middle: Floats, at_m: Floats, outward: Floats, towards: float) -> tuple[np.ndarray, Floats]:
    """From so far ahead, looking at the middle; RuntimeError when OpenGL is there but draws nothing."""
    camera, eye = plotter.camera, np.array([towards, 0.0, 0.0])
    camera.focal_point, camera.position, camera.up = tuple(middle), tuple(middle + 6.0 * eye), (0.0, 0.0, 1.0)
    plotter.remove_all_lights()
    for direction, strength in (((1.0, 0.5, 1.0), 0.9), ((1.0, -0.8, 0.2), 0.4)):
        light = pv.Light(light_type="scene light", intensity=strength, positional=False)
        light.position = tuple(10.0 * np.array(direction) * [towards, towards, 1.0])
        light.focal_point = (0.0, 0.0, 0.0)
        plotter.add_light(light)
    plotter.reset_camera_clipping_range()
    plotter.render()
    picture = np.asarray(plotter.screenshot(transparent_background=True, return_img=True))
    if picture[..., :3].std() == 0.0:
        raise RuntimeError("OpenGL is there but draws nothing")
    scale = SIZE[1] / _VIEW_HEIGHT_M
    across = SIZE[0] / 2 + scale * towards * (at_m[:, 1] - middle[1])
    down = SIZE[1] / 2 - scale * (at_m[:, 2] - middle[2])
    return _downsample(picture), np.stack([across, down, outward @ eye], axis=1)


def _downsample(picture: np.ndarray) -> np.ndarray:
    """(H, W, 4) of blocks of pixels, each counted by how opaque it is."""
    height, width, _ = picture.shape
    blocks = picture.reshape(
        height // _SUPERSAMPLING, _SUPERSAMPLING, width // _SUPERSAMPLING, _SUPERSAMPLING, 4
    ).astype(float)
    opaque = blocks[..., 3:].sum(axis=(1, 3))
    colour = (blocks[..., :3] * blocks[..., 3:]).sum(axis=(1, 3)) / np.maximum(opaque, 1.0)
    return np.concatenate([colour, opaque / _SUPERSAMPLING**2], axis=-1).round().astype(np.uint8)


if __name__ == "__main__":
    main(*sys.argv[1:])
