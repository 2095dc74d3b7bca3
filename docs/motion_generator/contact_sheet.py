"""Contact sheets: a clip as a row of figures seen from the side, and the same row from the front."""

import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.core.arrays import Floats
from harness.core.motion import Clip
from harness.core.skeleton import forward_kinematics
from harness.errors import BadInput

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = {"l": "#1f6fb2", "r": "#c8452d", "": "#4a4f57"}
_WIDTH_M = {"humerus": 0.085, "radius": 0.07, "wrist": 0.06, "hand": 0.07, "femur": 0.13, "tibia": 0.10, "foot": 0.07}
_TRUNK_WIDTH_M = {
    "lowerback": 0.22,
    "upperback": 0.24,
    "thorax": 0.26,
    "lowerneck": 0.11,
    "upperneck": 0.11,
    "head": 0.19,
}


def contact_sheet(
    clip: Clip,
    path: Path,
    *,
    start_s: float,
    every_s: float,
    figures: int = 10,
    rows: int = 1,
    title: str = "",
    faces: str = "thorax",
) -> None:
    """Write a PNG of `rows` strips of figures, `every_s` apart from `start_s` on; BadInput if the clip is too short.

    Each figure is seen from its right side (upper half of a strip) and from the front (lower half), by where the bone
    `faces` points on average within a second around; left limbs are blue, right ones red.
    """
    frames = np.rint((start_s + every_s * np.arange(figures * rows)) * clip.rate_hz).astype(int)
    if frames[-1] >= len(clip) or start_s < 0.0:
        raise BadInput(f"A sheet up to {frames[-1] / clip.rate_hz:.1f} s of {clip.name}.", "Take fewer figures.")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    pose = forward_kinematics(clip.skeleton, clip.root_m[frames], clip.world_from_root[frames], clip.angles_rad[frames])
    facing = _facing(clip, faces)[frames]
    tall, wide = 2.40, 1.15
    picture = Figure(figsize=(1.15 * figures, 2 * rows * 1.15 * tall / wide * 0.92), dpi=100)
    FigureCanvasAgg(picture)
    for row in range(rows):
        for view in (0, 1):
            axes = picture.add_axes((0.0, 1.0 - (2 * row + view + 1) / (2 * rows), 1.0, 1.0 / (2 * rows)))
            axes.set_xlim(-0.55 * wide, (figures - 0.35) * wide)
            axes.set_ylim(-0.15, tall - 0.15)
            axes.set_aspect("equal")
            axes.axis("off")
            axes.axhline(0.0, color="#b8b8b8", linewidth=1.0)
            for n in range(figures):
                k = row * figures + n
                points = np.stack([pose.start_m[k], pose.end_m[k]]) - clip.root_m[frames[k]] * [1.0, 1.0, 0.0]
                c, s = np.cos(facing[k]), np.sin(facing[k])
                ahead, left = points[..., 0] * c + points[..., 1] * s, points[..., 1] * c - points[..., 0] * s
                across, near = (ahead, -left) if view == 0 else (left, ahead)
                _draw(axes, clip, across + n * wide, points[..., 2], near, 72.0 * 1.15 / wide)
                if view == 0:
                    axes.text(
                        n * wide, -0.12, f"{frames[k] / clip.rate_hz:.2f} s", ha="center", fontsize=7, color="#555"
                    )
    picture.text(0.005, 0.995, title or clip.name, va="top", fontsize=9, color="#222")
    drawn = io.BytesIO()
    picture.savefig(drawn, format="png")
    with Image.open(drawn) as image:
        image.convert("RGB").quantize(64).save(path, optimize=True)  # few colours: a third of the size


def _facing(clip: Clip, bone: str) -> Floats:
    """(T,) the heading of a bone, averaged over a second around each frame [rad]."""
    pose = forward_kinematics(clip.skeleton, clip.root_m, clip.world_from_root, clip.angles_rad)
    ahead = pose.world_from_bone[:, clip.skeleton.index(bone), :, 0]
    yaw = np.arctan2(ahead[:, 1], ahead[:, 0])
    half = max(int(0.5 * clip.rate_hz), 1)
    window = np.ones(2 * half + 1)
    spread = [np.convolve(np.pad(f(yaw), half, mode="edge"), window, mode="valid") for f in (np.cos, np.sin)]
    out: Floats = np.arctan2(spread[1], spread[0])
    return out


def _draw(axes: "Axes", clip: Clip, across: Floats, up: Floats, near: Floats, points_per_m: float) -> None:
    """One figure: every bone a thick line with round ends, far ones first; `across`, `up`, `near` are (2, B) [m]."""
    for b in np.argsort(near.sum(axis=0)):
        name = clip.skeleton.names[b]
        side = name[0] if name[1:] in _WIDTH_M else ""
        width = _WIDTH_M.get(name[1:], _TRUNK_WIDTH_M.get(name, 0.05)) * points_per_m
        for colour, extra in (("white", 1.6), (_COLOURS[side], 0.0)):
            axes.plot(across[:, b], up[:, b], color=colour, linewidth=width + extra, solid_capstyle="round")
