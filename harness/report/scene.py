"""Truth and estimate as bodies in one picture, off-screen: a pale true body, an orange estimated one.

VTK without a working OpenGL may end the process instead of raising, so nothing but `harness.report.studio` imports
this file, in a process of its own. The estimate is drawn slimmer than the truth: where it is right it lies inside.
"""

import numpy as np
import pyvista as pv

from harness.body.anatomy import shapes
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.score.pair import Posed

TRUTH, ESTIMATE = "#5b87ad", "#e8850c"
"""Apart in lightness and in hue for every common kind of colour blindness."""
_PAPER, _FLOOR, _LINES, _SHADOW = "#f3f5f7", "#e6eaee", "#c9d1d8", "#c3ccd4"
_GRID_M, _REACH_M = 0.5, 5.0


class Scene:
    """One plotter for many pictures: two bodies, their shadows, a floor, and a camera that goes along."""

    def __init__(self, skeleton: Skeleton, size: tuple[int, int], heading_rad: float) -> None:
        """`size` in pixels; `heading_rad` is where the body faces, to see it from ahead and from the side."""
        self._plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="none")
        self._plotter.background_color = pv.Color(_PAPER)
        self._plotter.enable_anti_aliasing("msaa", multi_samples=8)
        self._truth = _Figure(self._plotter, skeleton, TRUTH, girth=1.0, opacity=0.3)
        self._estimate = _Figure(self._plotter, skeleton, ESTIMATE, girth=0.5, opacity=1.0)
        self._disc = self._plotter.add_mesh(pv.Disc(inner=0.0, outer=40.0, c_res=48), color=_FLOOR, lighting=False)
        self._grid = self._plotter.add_mesh(_grid(), color=_LINES, lighting=False, line_width=1.0)
        self._from = np.array([np.cos(heading_rad - 0.7), np.sin(heading_rad - 0.7), 0.22])
        for direction, strength in (((0.4, 0.6, 1.0), 0.85), ((-0.6, -0.5, 0.5), 0.35), ((0.2, -0.8, 0.3), 0.4)):
            turn = rotations.about_z(heading_rad)
            light = pv.Light(light_type="scene light", intensity=strength)
            light.position = tuple(rotations.rotate(turn, np.array(direction)) * 10.0)
            light.focal_point = (0.0, 0.0, 0.0)
            light.positional = False
            self._plotter.add_light(light)

    def picture(self, truth: Posed, estimate: Posed, frame: int) -> np.ndarray:
        """(height, width, 3) bytes of one frame of both motions."""
        self._truth.move(truth, frame)
        self._estimate.move(estimate, frame)
        at = np.array([*truth.root_m[frame, :2], 0.0])
        self._disc.position = tuple(at)
        self._grid.position = tuple(np.round(at / _GRID_M) * _GRID_M)
        middle = np.array([*at[:2], max(0.93, float(truth.root_m[frame, 2]) - 0.05)])
        self._plotter.camera.focal_point = tuple(middle)
        self._plotter.camera.position = tuple(middle + 4.6 * self._from)
        self._plotter.camera.up = (0.0, 0.0, 1.0)
        self._plotter.camera.view_angle = 27.0
        self._plotter.reset_camera_clipping_range()
        self._plotter.render()
        picture = np.asarray(self._plotter.screenshot(return_img=True))
        if picture.std() == 0.0:
            raise RuntimeError("OpenGL is there but draws nothing")
        return picture

    def close(self) -> None:
        self._plotter.close()


class _Figure:
    """A body of capsules and ellipsoids, drawn as one mesh whose points follow the bones, and its shadow."""

    def __init__(self, plotter: "pv.Plotter", skeleton: Skeleton, colour: str, girth: float, opacity: float) -> None:
        self._parts, meshes, first = [], [], 0
        for shape in shapes(skeleton):
            mesh = _mesh(shape.kind, shape.size_m, girth)
            turn = rotations.to_matrix(shape.bone_from_shape)
            mesh.points = mesh.points @ turn.T + shape.centre_m
            bone = -1 if shape.bone == "root" else skeleton.index(shape.bone)
            where = slice(first, first + mesh.n_points)
            self._parts.append((bone, where, np.asarray(mesh.points, dtype=float), mesh["Normals"] @ turn.T))
            meshes.append(mesh)
            first += mesh.n_points
        self._body = meshes[0].append_polydata(*meshes[1:])
        self._shadow = self._body.copy()
        self._skeleton = skeleton
        look = plotter.add_mesh(self._body, color=colour, opacity=opacity, culling="back").prop
        look.interpolation = "Phong"
        look.ambient, look.diffuse, look.specular, look.specular_power = 0.42, 0.8, 0.25, 12.0
        plotter.add_mesh(self._shadow, color=_SHADOW, lighting=False)

    def move(self, motion: Posed, frame: int) -> None:
        root = rotations.to_matrix(motion.world_from_root[frame])
        starts = start_m(motion, frame)
        points, normals = np.empty((self._body.n_points, 3)), np.empty((self._body.n_points, 3))
        for bone, where, local, normal in self._parts:
            turn = root if bone < 0 else motion.world_from_bone[frame, bone]
            points[where] = local @ turn.T + (motion.root_m[frame] if bone < 0 else starts[bone])
            normals[where] = normal @ turn.T
        self._body.points = points
        self._body["Normals"] = normals
        self._body.point_data.active_normals_name = "Normals"
        self._shadow.points = points * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.004]


def start_m(motion: Posed, frame: int) -> Floats:
    """(B, 3) joint that each bone turns about: the far end of its parent [m]."""
    parents = np.array(motion.skeleton.parents)
    out: Floats = motion.joints_m[frame, parents + 1]
    return out


def _mesh(kind: str, size_m: Floats, girth: float) -> "pv.PolyData":
    """A capsule along z or an ellipsoid, with normals."""
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
    """Lines every half metre, within a circle."""
    offsets = np.arange(-_REACH_M + _GRID_M, _REACH_M, _GRID_M)
    half = np.sqrt(_REACH_M**2 - offsets**2)
    ends = []
    for offset, reach in zip(offsets, half, strict=True):
        ends += [[offset, -reach, 0.002], [offset, reach, 0.002], [-reach, offset, 0.002], [reach, offset, 0.002]]
    return pv.line_segments_from_points(np.array(ends))
