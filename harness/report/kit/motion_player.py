"""The 3-D player of motions: bodies, stations and errors in plain JavaScript and WebGL, with its data packed.

An array of F frames and C columns is stored as integers. Each column is written as its first value and then the change
from frame to frame, which is small and compresses well. A change n becomes the code 2n, or -2n - 1 if it is negative. A
chunk is compressed by gzip and holds F and C (uint32, little-endian), then one byte for each code, column by column,
then as uint32 the codes above 254, whose byte is 255. Joint centres are stored as vectors from joint to joint.
"""

import base64
import gzip
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.skeleton import Skeleton
from harness.report.kit.body_chart import standing_body
from harness.report.kit.markup import Markup, join, tag

NO_ESTIMATE = 3
"""State of a frame without an estimate; 0 to 2 are those of `core.estimate.Status`."""
_SCRIPTS = ("motion_camera.js", "motion_renderer.js", "motion_data.js", "motion_player.js")
_ESCAPE = 255
_GIRTH_MM: dict[str, tuple[float, float]] = {
    "lowerback": (105, 110),
    "upperback": (110, 120),
    "thorax": (120, 85),
    "lowerneck": (62, 52),
    "upperneck": (52, 52),
    "head": (78, 86),
    "clavicle": (60, 56),
    "humerus": (52, 40),
    "radius": (40, 33),
    "wrist": (33, 26),
    "hand": (30, 22),
    "hipjoint": (98, 88),
    "femur": (84, 54),
    "tibia": (54, 36),
    "foot": (40, 30),
}
"""Radii of a bone at its joint and at its far end, by its name without the side [mm, choice]."""


@dataclass(frozen=True, eq=False)
class PlayerTrack:
    """One motion of a clip: F frames of J joint centres."""

    name: str
    joints_m: Floats
    """(F, J, 3) joint centres: the root, then the far end of each bone [m]."""
    states: Ints
    """(F,) 0 solved, 1 held, 2 lost, 3 no estimate; joint centres of state 3 are not drawn."""
    region_deg: Floats | None = None
    """(F,) mean half width of the stated 95 % region of the hinge angles [deg]; None if none is stated."""


@dataclass(frozen=True, eq=False)
class PlayerStations:
    """Stations in F frames: S poses in the world, and their states."""

    names: Sequence[str]
    position_m: Floats
    """(F, S, 3)."""
    world_from_station: Floats
    """(F, S, 4) unit quaternions."""
    states: Ints
    """(F, S) 0 valid, 1 position or orientation missing or held, 2 lost."""
    quality: Floats
    """(F, S) quality of the readings, 0 (lost) to 1 (best)."""


@dataclass(frozen=True, eq=False)
class PlayerClip:
    """A clip to play: F frames of a true motion, estimates and stations."""

    name: str
    """Stands in links to a moment."""
    title: str
    time_s: Floats
    """(F,) [s]."""
    heading_rad: float
    """Direction that the body faces, about the world's z axis [rad]."""
    truth: PlayerTrack | None
    estimates: Sequence[PlayerTrack] = ()
    stations: PlayerStations | None = None


@dataclass(frozen=True)
class PlayerMoment:
    """A part of a clip that the player offers to play."""

    title: str
    clip: int
    """Index of the clip."""
    method: str
    start_s: float
    end_s: float


@dataclass(frozen=True, eq=False)
class PlayerMotion:
    """Everything that a player shows. All tracks have the bones of `skeleton`."""

    skeleton: Skeleton
    clips: Sequence[PlayerClip]
    moments: Sequence[PlayerMoment] = ()
    shown: Sequence[str] = ()
    """Methods that are shown first; the first one of the clip without them."""


def hold_last(values: Floats) -> Floats:
    """Values (F, ...) whose rows with NaN repeat the last row before them, or the first one; zeros without any."""
    known = np.flatnonzero(np.isfinite(values).reshape(len(values), -1).all(axis=1))
    if not len(known):
        return np.zeros_like(values)
    nearest = known[np.maximum(np.searchsorted(known, np.arange(len(values)), side="right") - 1, 0)]
    out: Floats = values[nearest]
    return out


ChunkWriter = Callable[[bytes], str]
"""Stores a compressed chunk; returns what the page needs to find it."""


def player_card(motion: PlayerMotion, label: str) -> Markup:
    """The player with its data and scripts, for a page that loads nothing; `label` describes it to screen readers."""
    data = json.dumps(pack_motion(motion, _to_base64), separators=(",", ":")).replace("<", "\\u003c")
    return join(
        player_element(label),
        tag("script", Markup(data), type_="application/json", id_="motion"),
        tag("script", Markup(player_script())),
        tag("script", Markup(_mount_script('MotionData.ofPage("motion")'))),
    )


def player_element(label: str) -> Markup:
    """The element that the player fills, its style, and notes for print and for browsers without scripts.

    It shows a standing body until the player draws.
    """
    style = Path(__file__).with_name("motion_player.css").read_text(encoding="utf-8")
    return join(
        tag("style", Markup(style)),
        tag("div", standing_body(), class_="motion-player", id_="player", data_label=label),
        tag("p", "The 3-D view is not printed before it has been shown: scroll to it once.", class_="player-note"),
        tag("noscript", tag("p", "The 3-D view needs JavaScript and WebGL.")),
    )


def player_script() -> str:
    """The player's JavaScript, which defines `MotionPlayer` and `MotionData`."""
    return "\n".join(Path(__file__).with_name(name).read_text(encoding="utf-8") for name in _SCRIPTS)


def _mount_script(load: str) -> str:
    return f'MotionPlayer.mount(document.getElementById("player"), () => {load});'


def pack_motion(motion: PlayerMotion, write: ChunkWriter, chunk_frames: int = 1 << 30) -> dict[str, Any]:
    """The description of a motion as JSON types, with its arrays written in chunks of at most so many frames."""
    moments = [
        {"title": m.title, "clip": m.clip, "method": m.method, "time_s": m.start_s, "end_s": m.end_s}
        for m in motion.moments
    ]
    clips = [pack_clip(motion.skeleton, clip, write, chunk_frames) for clip in motion.clips]
    return {**describe_body(motion.skeleton), "clips": clips, "moments": moments, "shown": list(motion.shown)}


def describe_body(skeleton: Skeleton) -> dict[str, Any]:
    """Bones as pairs of joint centres, and their radii at both ends [mm]."""
    bones = [[parent + 1, bone + 1] for bone, parent in enumerate(skeleton.parents)]
    return {"bones": bones, "radii_mm": bone_radii_mm(skeleton)}


def bone_radii_mm(skeleton: Skeleton) -> list[list[float]]:
    """Radii of each bone at its joint and at its far end [mm]."""
    return [_radii_mm(name, length) for name, length in zip(skeleton.names, skeleton.length_m, strict=True)]


def pack_clip(skeleton: Skeleton, clip: PlayerClip, write: ChunkWriter, chunk_frames: int = 1 << 30) -> dict[str, Any]:
    """The description of one clip as JSON types, with its arrays written in chunks of at most so many frames."""

    def chunks(values: Floats | Ints) -> list[str]:
        rows = np.rint(values).astype(np.int64).reshape(len(values), -1)
        starts = range(0, max(1, len(rows)), chunk_frames)
        return [write(compress(encode(rows[at : at + chunk_frames]))) for at in starts]

    def track(role: str, content: PlayerTrack) -> dict[str, Any]:
        joints = _relative_mm(skeleton, content.joints_m)
        region = None if content.region_deg is None else chunks(10.0 * content.region_deg)
        states = chunks(content.states)
        return {"name": content.name, "role": role, "joints": chunks(joints), "states": states, "region": region}

    tracks = [track("truth", clip.truth)] if clip.truth else []
    tracks += [track("estimate", estimate) for estimate in clip.estimates]
    stations = None
    if clip.stations:
        poses = np.concatenate([1e3 * clip.stations.position_m, 1e3 * clip.stations.world_from_station], axis=2)
        states = chunks(clip.stations.states)
        quality = chunks(100.0 * clip.stations.quality)
        names = list(clip.stations.names)
        stations = {"names": names, "poses": chunks(poses), "states": states, "quality": quality}
    return {
        "name": clip.name,
        "title": clip.title,
        "heading": round(clip.heading_rad, 3),
        "height_m": _height_m(clip),
        "time": chunks(1e4 * clip.time_s),
        "tracks": tracks,
        "stations": stations,
    }


def encode(rows: Ints) -> bytes:
    """The bytes of integers (F, C) in the format of this module, before compression."""
    changes = np.diff(rows.T, axis=1, prepend=0).ravel()
    codes = np.where(changes < 0, -2 * changes - 1, 2 * changes)
    long = codes >= _ESCAPE
    header = np.array(rows.shape, "<u4").tobytes()
    return header + np.where(long, _ESCAPE, codes).astype(np.uint8).tobytes() + codes[long].astype("<u4").tobytes()


def compress(data: bytes) -> bytes:
    """Compressed by gzip; the same data gives the same bytes."""
    return gzip.compress(data, 6, mtime=0)


def _to_base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _relative_mm(skeleton: Skeleton, joints_m: Floats) -> Floats:
    """(F, J, 3) rounded joint centres: the root, then each bone's far end relative to its joint [mm]."""
    joints_mm = np.rint(1e3 * joints_m)
    out = joints_mm.copy()
    out[:, 1:] -= joints_mm[:, np.array(skeleton.parents) + 1]
    return out


def _height_m(clip: PlayerClip) -> float:
    """Median height of the motion [m], for the camera; that of a person without one."""
    tracks = [track for track in (clip.truth, *clip.estimates) if track is not None and len(track.joints_m)]
    return round(float(np.median(np.ptp(tracks[0].joints_m[..., 2], axis=1))), 2) if tracks else 1.75


def _radii_mm(bone: str, length_m: float) -> list[float]:
    name = bone if bone in _GIRTH_MM else bone[1:]
    default = float(np.clip(180.0 * length_m, 14.0, 42.0))
    return [round(r, 1) for r in _GIRTH_MM.get(name, (default, 0.75 * default))]
