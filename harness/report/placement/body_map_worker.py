"""The process that renders the body map: `python -m harness.report.placement.body_map_worker JOB.npz OUT.npz`.

`harness.report.placement.body_map` starts it as a separate process, because VTK may crash without a working OpenGL.
The body stands in the T-pose; each point of the skin has the colour of the places on its own bone.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np

from harness.body import Mount, body_geoms, locate_mount, tpose
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.files import write_npz
from harness.core.humanoid24 import standard_skeleton, unpack
from harness.core.skeleton import BodyGeom, Skeleton, forward_kinematics
from harness.core.working_folder import plain_import
from harness.report.placement.body_map import interpolate_colours

with plain_import():
    import pyvista as pv

SIZE = (760, 740)
"""Width and height of one view [px]."""
_SUPERSAMPLING = 2
"""Pixels rendered and averaged per pixel and axis, because VTK does not smooth pictures without background."""
NEUTRAL_COLOUR = (0.74, 0.76, 0.79)
"""Skin of bones on which no place was tried."""
_BASE_COLOUR = "#3a4250"
"""Colour of balls without a value, which are stations that are already worn."""
_VIEW_HEIGHT_M = 1.86
"""Height that a view shows [m]."""
_RIMS = ((0.030, "#16191d"), (0.026, "#ffffff"))
"""Radius [m] and colour of the rims around a ball."""
_BALL_M = 0.019
_PELVIS = ("root", "lhipjoint", "rhipjoint")
"""Bones that are rigid with each other and share one skin."""


def main(job: str, output: str) -> None:
    """Render both views of the body.

    Writes `picture` (2, height, width, 4), from the front and from behind, and `at` (2, N, 3): each place's x and y
    [px] and the cosine by which it faces the camera.
    """
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
    """Joint positions and rotations of the bones in the T-pose."""

    def __init__(self, skeleton: Skeleton) -> None:
        root_m, world_from_root, angles = unpack(tpose(skeleton)[None])
        pose = forward_kinematics(skeleton, root_m, world_from_root, angles)
        self._root = root_m[0], rotations.to_matrix(world_from_root[0])
        self._bones = dict(zip(skeleton.names, zip(pose.start_m[0], pose.world_from_bone[0], strict=True), strict=True))

    def joint_pose(self, bone: str) -> tuple[Floats, Floats]:
        """Joint (3,) [m] and rotation (3, 3) of a bone, or of the root."""
        return self._bones.get(bone, self._root)


def _mount_positions(skeleton: Skeleton, standing: _TPose, mounts: list[Mount]) -> tuple[Floats, Floats]:
    """(N, 3) position of the skin under each mount [m], and (N, 3) its outward normal."""
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
    """The mesh of one part of the body, its points in the colours of the places on its bone."""
    mesh = _mesh(shape)
    mesh.points = np.asarray(mesh.points) @ rotations.to_matrix(shape.bone_from_shape).T + shape.centre_m
    start_m, turn = standing.joint_pose(shape.bone)
    mesh.points = np.asarray(mesh.points) @ turn.T + start_m
    carriers = _PELVIS if shape.bone in _PELVIS else (shape.bone,)
    members = np.array([n for n, bone in enumerate(bones) if bone in carriers and known[n]], dtype=int)
    mesh["colour"] = np.tile(NEUTRAL_COLOUR, (mesh.n_points, 1))
    if len(members):
        mesh["colour"] = interpolate_colours(np.asarray(mesh.points, dtype=float), at_m[members], colour[members])
    return mesh


def _mesh(shape: BodyGeom) -> "pv.PolyData":
    """A capsule along z, or an ellipsoid, with points close enough to take colours."""
    half = float(shape.size_m[1]) if shape.kind == "capsule" else 0.0
    radii = np.full(3, shape.size_m[0]) if shape.kind == "capsule" else shape.size_m
    turn, rise = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 32), np.linspace(0.0, 1.0, 16 if half else 1)
    around = np.linspace(0.0, 2.0 * np.pi, 45)
    # Lower cap, cylinder and upper cap: relative radius and height of each ring.
    radius = np.concatenate([np.cos(turn[:16]), np.ones(len(rise)), np.cos(turn[16:])])
    height = np.concatenate(
        [radii[2] * np.sin(turn[:16]) - half, half * (2.0 * rise - 1.0), radii[2] * np.sin(turn[16:]) + half]
    )
    x, y = (radii[k] * np.outer(radius, circle(around)) for k, circle in enumerate((np.cos, np.sin)))
    surface = pv.StructuredGrid(x, y, np.outer(height, np.ones_like(around))).extract_surface(algorithm=None)
    mesh: pv.PolyData = surface.triangulate().clean(tolerance=1e-6)
    return mesh


def _views(
    body: "list[pv.PolyData]", at_m: Floats, outward: Floats, colour: Floats, known: Floats
) -> list[tuple[np.ndarray, Floats]]:
    """The views from the front and from behind, each as a picture and the places on it (see `main`)."""
    plotter: Any = pv.Plotter(off_screen=True, window_size=[_SUPERSAMPLING * side for side in SIZE], lighting="none")
    merged = body[0].append_polydata(*body[1:])
    low, high = merged.bounds[4:6]
    middle = np.array([0.0, 0.0, 0.5 * (low + high)])
    try:
        shading = {"ambient": 0.62, "diffuse": 0.45, "specular": 0.0, "smooth_shading": True}
        plotter.add_mesh(merged, scalars="colour", rgb=True, **shading)
        for at, normal, shade, has_value in zip(at_m, outward, colour, known, strict=True):
            centre = at + 0.5 * _BALL_M * normal
            for radius, rim in _RIMS:
                ball = pv.Sphere(radius=radius, center=centre)
                plotter.add_mesh(ball, color=rim, culling="front", lighting=False)
            plotter.add_mesh(
                pv.Sphere(radius=_BALL_M, center=centre), color=shade if has_value else _BASE_COLOUR, **shading
            )
        plotter.enable_parallel_projection()
        plotter.camera.parallel_scale = 0.5 * _VIEW_HEIGHT_M
        return [_view(plotter, middle, at_m, outward, towards) for towards in (1.0, -1.0)]
    finally:
        plotter.close()


def _view(plotter: Any, middle: Floats, at_m: Floats, outward: Floats, towards: float) -> tuple[np.ndarray, Floats]:
    """One view of the middle of the body, with the camera at +x or -x (`towards` is 1 or -1).

    RuntimeError if OpenGL works without error but draws nothing.
    """
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
        raise RuntimeError("OpenGL is available but draws nothing")
    scale = SIZE[1] / _VIEW_HEIGHT_M
    across = SIZE[0] / 2 + scale * towards * (at_m[:, 1] - middle[1])
    down = SIZE[1] / 2 - scale * (at_m[:, 2] - middle[2])
    return _downsample(picture), np.stack([across, down, outward @ eye], axis=1)


def _downsample(picture: np.ndarray) -> np.ndarray:
    """(H, W, 4) means over blocks of pixels, weighted by opacity."""
    height, width, _ = picture.shape
    blocks = picture.reshape(
        height // _SUPERSAMPLING, _SUPERSAMPLING, width // _SUPERSAMPLING, _SUPERSAMPLING, 4
    ).astype(float)
    opaque = blocks[..., 3:].sum(axis=(1, 3))
    colour = (blocks[..., :3] * blocks[..., 3:]).sum(axis=(1, 3)) / np.maximum(opaque, 1.0)
    return np.concatenate([colour, opaque / _SUPERSAMPLING**2], axis=-1).round().astype(np.uint8)


if __name__ == "__main__":
    main(*sys.argv[1:])
