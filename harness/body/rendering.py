"""Rendering of bodies with pyvista: a floor with lights and a camera, and meshes that follow the bones.

VTK without a working OpenGL may end the process instead of raising an error, so this module is imported in processes of
their own only.
"""

from typing import Any

import numpy as np

from harness.body.anatomy import body_geoms
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.core.working_folder import plain_import

with plain_import():
    import pyvista as pv

_BACKGROUND, _FLOOR, _LINES, _SHADOW = "#f3f5f7", "#e6eaee", "#c9d1d8", "#c3ccd4"
_LINES_ON_ANY_GROUND = "#8d97a2"
"""Colour of the grid that is seen on white and on black."""
_GRID_M, _FLOOR_RADIUS_M = 0.5, 5.0
_CAMERA_DISTANCE_M = 4.6


class RenderScene:
    """A plotter with a floor, lights, and a camera that follows the body."""

    def __init__(
        self, size: tuple[int, int], heading_rad: float, *, off_screen: bool = True, transparent: bool = False
    ) -> None:
        """`size` is in pixels; `heading_rad` is the body's heading, which the camera sees obliquely from the front.

        Transparent pictures have the lines of the floor alone, for pages that are light or dark.
        """
        self._transparent = transparent
        self.plotter: Any = pv.Plotter(off_screen=off_screen, window_size=list(size), lighting="none")
        self.plotter.background_color = pv.Color(_BACKGROUND)
        self.plotter.enable_anti_aliasing("msaa", multi_samples=8)
        self._disc = self.plotter.add_mesh(pv.Disc(inner=0.0, outer=40.0, c_res=48), color=_FLOOR, lighting=False)
        self._disc.visibility = not transparent
        lines = {"color": _LINES_ON_ANY_GROUND, "opacity": 0.4} if transparent else {"color": _LINES}
        self._grid = self.plotter.add_mesh(_grid(), lighting=False, line_width=1.0, **lines)
        camera = self.plotter.camera
        camera.focal_point = (0.0, 0.0, 0.0)
        camera.position = tuple(
            _CAMERA_DISTANCE_M * np.array([np.cos(heading_rad - 0.7), np.sin(heading_rad - 0.7), 0.22])
        )
        camera.up = (0.0, 0.0, 1.0)
        camera.view_angle = 27.0
        for direction, strength in (((0.4, 0.6, 1.0), 0.85), ((-0.6, -0.5, 0.5), 0.35), ((0.2, -0.8, 0.3), 0.4)):
            turn = rotations.about_z(heading_rad)
            light = pv.Light(light_type="scene light", intensity=strength)
            light.position = tuple(rotations.rotate(turn, np.array(direction)) * 10.0)
            light.focal_point = (0.0, 0.0, 0.0)
            light.positional = False
            self.plotter.add_light(light)

    def follow(self, root_m: Floats) -> None:
        """Move floor and camera to the root (3,) [m]; the viewing direction stays."""
        floor_m = np.array([*root_m[:2], 0.0])
        self._disc.position = tuple(floor_m)
        self._grid.position = tuple(np.round(floor_m / _GRID_M) * _GRID_M)
        middle = np.array([*floor_m[:2], max(0.93, float(root_m[2]) - 0.05)])
        camera = self.plotter.camera
        away = np.array(camera.position) - np.array(camera.focal_point)
        camera.focal_point = tuple(middle)
        camera.position = tuple(middle + away)
        self.plotter.reset_camera_clipping_range()

    def picture(self) -> np.ndarray:
        """(height, width, 3) picture in bytes, with opacity (height, width, 4) if it is transparent.

        RuntimeError if OpenGL draws nothing.
        """
        self.plotter.render()
        picture = np.asarray(self.plotter.screenshot(return_img=True, transparent_background=self._transparent))
        if picture.std() == 0.0:
            raise RuntimeError("OpenGL is there but draws nothing")
        return picture

    def close(self) -> None:
        self.plotter.close()


class BodyMesh:
    """One mesh of a body's capsules and ellipsoids, whose points follow the bones, and its shadow."""

    def __init__(
        self, plotter: "pv.Plotter", skeleton: Skeleton, colour: str, girth: float, opacity: float, shadow: bool = True
    ) -> None:
        self._parts, meshes, first = [], [], 0
        for geom in body_geoms(skeleton):
            mesh = _mesh(geom.kind, geom.size_m, girth)
            turn = rotations.to_matrix(geom.bone_from_shape)
            mesh.points = mesh.points @ turn.T + geom.centre_m
            bone = -1 if geom.bone == "root" else skeleton.index(geom.bone)
            points = slice(first, first + mesh.n_points)
            self._parts.append((bone, points, np.asarray(mesh.points, dtype=float), mesh["Normals"] @ turn.T))
            meshes.append(mesh)
            first += mesh.n_points
        self._body = meshes[0].append_polydata(*meshes[1:])
        self._shadow = self._body.copy()
        actor: Any = plotter.add_mesh(self._body, color=colour, opacity=opacity, culling="back")
        self.look: Any = actor.prop
        self.look.interpolation = "Phong"
        self.look.ambient, self.look.diffuse, self.look.specular, self.look.specular_power = 0.42, 0.8, 0.25, 12.0
        shadows = [plotter.add_mesh(self._shadow, color=_SHADOW, lighting=False)] if shadow else []
        self._actors: Any = (actor, *shadows)

    def set_visible(self, visible: bool) -> None:
        """Show or hide the body and its shadow."""
        for actor in self._actors:
            actor.visibility = visible

    def move(self, root_m: Floats, world_from_root: Floats, start_m: Floats, world_from_bone: Floats) -> None:
        """Set the pose of the root (3,) [m], (3, 3) and of the bones' joints (B, 3) [m], (B, 3, 3)."""
        points, normals = np.empty((self._body.n_points, 3)), np.empty((self._body.n_points, 3))
        for bone, where, local, normal in self._parts:
            turn = world_from_root if bone < 0 else world_from_bone[bone]
            points[where] = local @ turn.T + (root_m if bone < 0 else start_m[bone])
            normals[where] = normal @ turn.T
        self._body.points = points
        self._body["Normals"] = normals
        self._body.point_data.active_normals_name = "Normals"
        self._shadow.points = points * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.004]


def _mesh(kind: str, size_m: Floats, girth: float) -> "pv.PolyData":
    """Mesh of a capsule along z or of an ellipsoid, with normals; `girth` scales its thickness."""
    ball = pv.Sphere(radius=1.0, theta_resolution=20, phi_resolution=16)
    unit = np.asarray(ball.points, dtype=float)
    mesh = pv.PolyData(ball.points.copy(), ball.faces)
    if kind == "capsule":
        radius, half = girth * float(size_m[0]), float(size_m[1])
        mesh.points = unit * radius + np.where(unit[:, 2:] >= 0.0, half, -half) * [0.0, 0.0, 1.0]
        mesh["Normals"] = unit
    else:
        thin = size_m * [girth, girth, 0.5 + 0.5 * girth]
        mesh.points = unit * thin
        outward = unit / thin
        mesh["Normals"] = outward / np.linalg.norm(outward, axis=1, keepdims=True)
    return mesh


def _grid() -> "pv.PolyData":
    """Grid lines every half metre within the floor's radius."""
    offsets = np.arange(-_FLOOR_RADIUS_M + _GRID_M, _FLOOR_RADIUS_M, _GRID_M)
    half = np.sqrt(_FLOOR_RADIUS_M**2 - offsets**2)
    ends = []
    for offset, reach in zip(offsets, half, strict=True):
        ends += [[offset, -reach, 0.002], [offset, reach, 0.002], [-reach, offset, 0.002], [reach, offset, 0.002]]
    return pv.line_segments_from_points(np.array(ends))
