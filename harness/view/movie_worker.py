"""The process that draws a movie: `python -m harness.view.movie_worker JOB.npz`, started by `movie`.

It draws the same capsules as the player in the browser. The file is written whole or not at all.
"""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from harness.body import RenderScene
from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.files import atomic_path
from harness.core.working_folder import plain_import
from harness.view.movie import DRAWN_SUFFIX

with plain_import():
    import pyvista as pv

TRUTH, _METHODS, _LOST = "#5b87ad", ("#e8850c", "#0f9d76", "#c05f9c"), "#8d98a5"
_STATIONS = ("#20a4a8", "#e0b000", "#d43c3c")
"""Colours of a station that is valid, partly missing, or lost."""
_AXES = ("#d84a3a", "#3f9b45", "#3b6fd4")
_RAMP = ("#2c7bb6", "#7fc7c9", "#f2e394", "#f3913c", "#c2182b")
"""Colours of errors from 0 to `_WORST_M`."""
_WORST_M = 0.1
_NO_ESTIMATE, _LOST_STATE = 3, 2
_PANE, _ALONE = (480, 560), (640, 640)
"""Width and height of one of several panes, and of a single one [px]; even, as H.264 wants."""
_AROUND, _RINGS = 16, 4
_DISC_M, _DISC_RADIUS_M, _AXIS_M, _AXIS_RADIUS_M = 0.022, 0.019, 0.11, 0.0055
_INK, _FAINT = "#23282f", "#5d6773"


class CapsuleMesh:
    """One mesh of N capsules, each from a point to a point with a radius and a colour at either end."""

    def __init__(self, plotter: Any, count: int, opacity: float) -> None:
        latitude = np.concatenate([np.linspace(-0.5, 0.0, _RINGS + 1), np.linspace(0.0, 0.5, _RINGS + 1)]) * np.pi
        turn = np.arange(_AROUND) * 2.0 * np.pi / _AROUND
        rows, columns = np.meshgrid(latitude, turn, indexing="ij")
        self._unit = np.stack([np.cos(rows) * np.cos(columns), np.cos(rows) * np.sin(columns), np.sin(rows)], -1)
        self._unit = self._unit.reshape(-1, 3)
        self._end = np.repeat(np.arange(len(latitude)) > _RINGS, _AROUND).astype(float)
        corner = np.arange(len(latitude) * _AROUND).reshape(len(latitude), _AROUND)
        a, b = corner[:-1], corner[1:]
        quads = np.stack([a, np.roll(a, -1, 1), np.roll(b, -1, 1), b], -1).reshape(-1, 4)
        every = (quads[None] + len(self._unit) * np.arange(count)[:, None, None]).reshape(-1, 4)
        faces = np.hstack([np.full((len(every), 1), 4), every]).ravel()
        points = np.zeros((count * len(self._unit), 3))
        self._body, self._shadow = pv.PolyData(points, faces), pv.PolyData(points.copy(), faces)
        self._body["colour"] = np.zeros((len(points), 3), dtype=np.uint8)
        self._body["Normals"] = np.tile([0.0, 0.0, 1.0], (len(points), 1))
        actor: Any = plotter.add_mesh(self._body, scalars="colour", rgb=True, opacity=opacity, culling="back")
        actor.prop.interpolation = "Phong"
        actor.prop.ambient, actor.prop.diffuse, actor.prop.specular = 0.42, 0.8, 0.2
        self._actors = (actor, plotter.add_mesh(self._shadow, color="#c3ccd4", lighting=False))

    def move(self, ends_m: Floats, radii_m: Floats, colours: Floats) -> None:
        """Set ends (N, 2, 3) [m], radii (N, 2) [m] and colours (N, 2, 3), 0 to 1."""
        along = ends_m[:, 1] - ends_m[:, 0]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        z = np.where(length > 1e-6, along / np.maximum(length, 1e-6), [0.0, 0.0, 1.0])
        x = np.cross(z, np.where(np.abs(z[:, 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        normal = self._unit @ np.stack([x, np.cross(z, x), z], axis=1)
        share = self._end[:, None]
        middle = ends_m[:, None, 0] * (1.0 - share) + ends_m[:, None, 1] * share
        radius = radii_m[:, None, :1] * (1.0 - share) + radii_m[:, None, 1:] * share
        paint = colours[:, None, 0] * (1.0 - share) + colours[:, None, 1] * share
        points = (middle + radius * normal).reshape(-1, 3)
        self._body.points = points
        self._body["Normals"] = normal.reshape(-1, 3)
        self._body.point_data.active_normals_name = "Normals"
        self._body["colour"] = np.rint(255.0 * paint).astype(np.uint8).reshape(-1, 3)
        self._shadow.points = points * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.004]

    def show(self, visible: bool) -> None:
        for actor in self._actors:
            actor.visibility = bool(visible)


class MoviePane:
    """One view: the truth, one method or none, and the stations."""

    def __init__(self, job: dict[str, Any], method: int | None, size: tuple[int, int]) -> None:
        self._job, self._method = job, method
        self._scene = RenderScene(size, float(job["heading_rad"]))
        beside = method is not None
        plotter, bones = self._scene.plotter, len(job["bones"])
        self._estimate = CapsuleMesh(plotter, bones, 1.0) if beside else None
        self._stations = CapsuleMesh(plotter, 4 * job["station_m"].shape[1], 1.0) if "station_m" in job else None
        self._truth = CapsuleMesh(plotter, bones, 0.3 if beside else 1.0) if "truth_m" in job else None

    def picture(self, frame: int) -> "np.ndarray[Any, Any]":
        """(height, width, 3) bytes."""
        job, root_m = self._job, None
        bones, radii_m = job["bones"], job["radii_m"]
        truth_m = job["truth_m"][frame] if "truth_m" in job else None
        known = truth_m is not None and job["truth_states"][frame] != _NO_ESTIMATE
        if self._method is not None and self._estimate is not None:
            joints_m, state = job[f"joints_m_{self._method}"][frame], job[f"states_{self._method}"][frame]
            paint = np.tile(rgb(_LOST if state == _LOST_STATE else _METHODS[self._method]), (len(joints_m), 1))
            if known and job["colour_by_error"]:
                paint = error_colours(np.linalg.norm(joints_m - truth_m, axis=1))
            self._estimate.move(joints_m[bones], (0.6 if known else 1.0) * radii_m, paint[bones])
            self._estimate.show(state != _NO_ESTIMATE)
            root_m = joints_m[0]
        if truth_m is not None and self._truth is not None:
            self._truth.move(truth_m[bones], radii_m, np.broadcast_to(rgb(TRUTH), (len(bones), 2, 3)))
            self._truth.show(known)
            root_m = truth_m[0] if known or root_m is None else root_m
        if self._stations is not None:
            parts = (job[name][frame] for name in ("station_m", "world_from_station", "station_states"))
            self._stations.move(*station_capsules(*parts))
            root_m = np.mean(job["station_m"][frame], axis=0) if root_m is None else root_m
        if root_m is not None:
            self._scene.follow(root_m)
        return self._scene.picture()

    def close(self) -> None:
        self._scene.close()


def station_capsules(
    at_m: Floats, world_from_station: Floats, states: Ints, size: float = 1.0
) -> tuple[Floats, Floats, Floats]:
    """Ends, radii and colours of a disc and three axes for each of S stations, `size` times as large as usual.

    `at_m` (S, 3) are positions, `world_from_station` (S, 4) orientations, and `states` (S,) index the discs' colours.
    """
    axes = np.swapaxes(rotations.to_matrix(world_from_station), 1, 2)
    disc = at_m[:, None] + size * _DISC_M * np.stack([-axes[:, 0], axes[:, 0]], axis=1)
    arms = np.stack([np.broadcast_to(at_m[:, None], axes.shape), at_m[:, None] + size * _AXIS_M * axes], axis=2)
    ends_m = np.concatenate([disc[:, None], arms], axis=1).reshape(-1, 2, 3)
    radii_m = size * np.tile([_DISC_RADIUS_M, *[_AXIS_RADIUS_M] * 3], len(at_m))
    colours = np.array([[rgb(_STATIONS[state]), *map(rgb, _AXES)] for state in states.tolist()]).reshape(-1, 3)
    return ends_m, np.stack([radii_m, radii_m], axis=1), np.stack([colours, colours], axis=1)


def rgb(colour: str) -> Floats:
    """(3,) parts of a colour "#rrggbb", 0 to 1."""
    return np.array([int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])


def error_colours(error_m: Floats, worst_m: float = _WORST_M) -> Floats:
    """(J, 3) colours of errors (J,) [m]: the last colour of the ramp from `worst_m` on."""
    ramp, place = np.array([rgb(c) for c in _RAMP]), np.linspace(0.0, worst_m, len(_RAMP))
    return np.stack([np.interp(error_m, place, ramp[:, c]) for c in range(3)], axis=1)


def _pictures(job: dict[str, Any], drawn: Path) -> Iterator["np.ndarray[Any, Any]"]:
    """The frames of the movie, with titles; the file `drawn` grows by a byte for each."""
    methods: Sequence[int | None] = range(len(job["methods"])) if len(job["methods"]) else [None]
    size = _ALONE if len(methods) == 1 else _PANE
    panes = [MoviePane(job, method, size) for method in methods]
    try:
        with drawn.open("wb", buffering=0) as count:
            for frame in range(len(job["time_s"])):
                picture = np.hstack([pane.picture(frame) for pane in panes])
                yield _add_captions(picture, job, frame, size[0])
                count.write(b".")
    finally:
        for pane in panes:
            pane.close()


def _add_captions(picture: Floats, job: dict[str, Any], frame: int, width: int) -> "np.ndarray[Any, Any]":
    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(picture)
    pen, font = ImageDraw.Draw(image), ImageFont.load_default(17)
    pen.text((16, 12), str(job["title"]), _INK, font)
    pen.text((16, 34), f"{job['time_s'][frame]:.2f} s", _FAINT, font)
    for n, name in enumerate(job["methods"].tolist()):
        pen.text((n * width + 16, 56), name, _METHODS[n], font)
    return np.asarray(image)


def _write_mp4(pictures: Iterator["np.ndarray[Any, Any]"], fps: float, path: Path) -> None:
    """An H.264 movie that browsers play."""
    import imageio_ffmpeg

    first = next(pictures)
    options = {"fps": fps, "codec": "libx264", "quality": None, "macro_block_size": 2, "pix_fmt_out": "yuv420p"}
    encoding = ["-crf", "22", "-preset", "veryfast", "-movflags", "+faststart", "-f", "mp4"]
    writer = imageio_ffmpeg.write_frames(str(path), first.shape[1::-1], **options, output_params=encoding)
    writer.send(None)
    try:
        writer.send(np.ascontiguousarray(first))
        for picture in pictures:
            writer.send(np.ascontiguousarray(picture))
    finally:
        writer.close()


def _write_gif(pictures: Iterator["np.ndarray[Any, Any]"], fps: float, path: Path) -> None:
    """An animated picture with 128 colours."""
    from PIL import Image

    images = (Image.fromarray(picture).quantize(128, dither=Image.Dither.NONE) for picture in pictures)
    first = next(images)
    first.save(path, format="gif", save_all=True, append_images=images, duration=round(1e3 / fps), loop=0)


def main(job_file: str) -> None:
    with np.load(job_file, allow_pickle=False) as content:
        job = {name: content[name] for name in content.files}
    output, fps = Path(str(job["output"])), float(job["fps"])
    write = _write_gif if output.suffix.lower() == ".gif" else _write_mp4
    with atomic_path(output) as temporary:
        write(_pictures(job, Path(job_file + DRAWN_SUFFIX)), fps, temporary)


if __name__ == "__main__":
    main(sys.argv[1])
