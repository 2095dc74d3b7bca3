"""The interactive 3-D view of truth and estimate as skeletons, with data packed for `skeleton_player.js`."""

import base64
import gzip
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from harness.core import rotations
from harness.core.skeleton import Skeleton
from harness.errors import MissingExtra
from harness.report.kit.markup import Markup, join, tag
from harness.score.pair import PoseSequence

_MOST_FRAMES = 120
"""Frames of one segment; faster streams are thinned to that many."""


@dataclass(frozen=True, eq=False)
class PlayerSegment:
    """Part of a cell to play: F frames of truth and estimate."""

    title: str
    time_s: Sequence[float]
    truth: PoseSequence
    estimate: PoseSequence


def skeleton_player(skeleton: Skeleton, segments: Sequence[PlayerSegment]) -> tuple[Markup, str]:
    """The player with its data and scripts and "", or nothing and the reason why there is none."""
    if find_spec("plotly") is None:
        return Markup(), str(MissingExtra("The interactive view", "plotly", "viz"))
    from plotly.offline import get_plotlyjs

    bones = [[parent + 1, bone + 1] for bone, parent in enumerate(skeleton.parents)]
    data = {"bones": bones, "head": skeleton.index("head"), "shots": [_pack(segment) for segment in segments]}
    script = Path(__file__).with_name("skeleton_player.js").read_text(encoding="utf-8")
    choices = [tag("option", segment.title, value=n) for n, segment in enumerate(segments)]
    page = join(
        tag("p", tag("label", "Show ", tag("select", *choices, id_="shot")), class_="controls"),
        tag("div", id_="stage", role="img", aria_label="Truth and estimate as skeletons in 3-D; drag to turn"),
        tag(
            "p",
            tag("button", "Play", id_="play", type_="button"),
            tag("input", id_="frame", type_="range", min_=0, max_=0, value=0, step=1, aria_label="frame"),
            tag("output", "loads when scrolled to", id_="where", for_="frame"),
            tag("button", "Reset view", id_="reset", type_="button"),
            class_="controls",
        ),
        tag("script", Markup(_compress(json.dumps(data, separators=(",", ":")))), type_="text/plain", id_="shots"),
        tag("script", Markup(_compress(get_plotlyjs())), type_="text/plain", id_="plotly"),
        tag("script", Markup(script)),
    )
    return page, ""


def _pack(segment: PlayerSegment) -> dict[str, Any]:
    """Times [ms], heading [rad] and joint centres in whole millimetres as differences, which compress well."""
    every = -(-len(segment.time_s) // _MOST_FRAMES)
    time_ms = [round(1e3 * t) for t in segment.time_s[::every]]
    return {
        "time_ms": time_ms,
        "heading_rad": heading_rad(segment.truth),
        "truth": _frame_differences(segment.truth, every),
        "estimate": _frame_differences(segment.estimate, every),
    }


def heading_rad(motion: PoseSequence) -> float:
    """Mean direction of the root's forward axis about the world's z axis [rad]."""
    ahead = np.mean(rotations.to_matrix(motion.world_from_root)[:, :, 0], axis=0)
    return float(np.arctan2(ahead[1], ahead[0]))


def _frame_differences(motion: PoseSequence, every: int) -> list[list[int]]:
    """The first of the thinned frames, then the change from frame to frame [mm]."""
    joints_mm = np.rint(1e3 * motion.joints_m[::every]).astype(int).reshape(-1, 3 * motion.joints_m.shape[1])
    steps: list[list[int]] = np.diff(joints_mm, axis=0, prepend=0).tolist()
    return steps


def _compress(text: str) -> str:
    return base64.b64encode(gzip.compress(text.encode(), 6, mtime=0)).decode()
