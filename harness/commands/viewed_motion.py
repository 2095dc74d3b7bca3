"""What `view` shows: a clip, the clips of a run, or a recording, as motion for the player."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.estimate import mean_region_deg
from harness.core.humanoid24 import standard_skeleton
from harness.core.motion import Clip
from harness.core.progress import ProgressCallback
from harness.core.skeleton import forward_kinematics
from harness.errors import BadFile, BadInput, UnknownName
from harness.mocap import (
    CLIP_FORMATS,
    LibraryFolders,
    MotionLibrary,
    SyntheticSource,
    find_library_folders,
    folders_of_environment,
    read_clip,
)
from harness.report.kit import NO_ESTIMATE, PlayerClip, PlayerStations, PlayerTrack, hold_last
from harness.view import ViewedMotion

if TYPE_CHECKING:
    from harness.stream import TrackerFrame
    from harness.stream.recording import PoseRecording

_SEED = 1
"""Seed of built-in motion that is named by its take, as in the shipped scenarios."""
_KINDS = "a folder of `harness run`, a recording, a motion file, or the name of a clip"


def open_motion(
    what: str,
    *,
    methods: Sequence[str] | None,
    mocap: LibraryFolders | None,
    rate_hz: float | None,
    playback: dict[str, Any],
    progress: ProgressCallback = lambda step, done, planned: None,
) -> ViewedMotion:
    """Open the motion that a text names: a folder, a file, or a clip.

    `methods` are those of a run or recording; None is all of a run and none of a recording. `rate_hz` is the rate of an
    AMC file that no index names, `playback` the options of `recorded_take.find_playback`. `progress` is called while
    methods learn and run. Raises UnknownName, BadFile or BadInput for what cannot be shown.
    """
    path = Path(what)
    if path.is_dir():
        _refuse_options(playback, "A run")
        return _view_run(path, methods)
    is_motion = path.suffix.lower().lstrip(".") in (*CLIP_FORMATS, "asf")
    if path.exists() and not is_motion:
        return _view_recording(path, methods or (), playback, mocap, progress)
    if methods:
        raise BadInput(f"--methods with {what}.", "A clip has no estimates: name a run or a recording.")
    _refuse_options(playback, "A clip")
    return view_clip(open_clip(what, mocap, rate_hz))


def open_clip(what: str, mocap: LibraryFolders | None, rate_hz: float | None = None) -> Clip:
    """The clip that a text names: a motion file, a built-in take or a clip of the library.

    `rate_hz` is the rate of an AMC file that no index names. Raises UnknownName, BadFile or BadInput.
    """
    path = Path(what)
    return read_clip(path, rate_hz) if path.exists() else _find_clip(what, mocap)


def _refuse_options(playback: dict[str, Any], kind: str) -> None:
    for name, value in playback.items():
        if value is not None:
            raise BadInput(f"{kind} takes no --{name}.", "It is for a recording.")


def _find_clip(name: str, mocap: LibraryFolders | None) -> Clip:
    """A built-in take or a clip of the library by its name; BadInput where there is no library."""
    built_in = SyntheticSource(_SEED)
    if name in built_in.names():
        return built_in.load(name)
    folders = find_library_folders(mocap) if mocap or folders_of_environment() else None
    library = None if folders is None else MotionLibrary(folders)
    if (Path(name).suffix or len(Path(name).parts) > 1) and (library is None or name not in library.names()):
        raise BadFile(name, "no such file or folder", _KINDS, "Check the path.")
    if library is None:
        found = f"There is no file, folder or built-in take {name!r}, and no library was named."
        raise BadInput(found, "`harness list` names the takes; --mocap DIR or HARNESS_MOCAP a library.")
    return library.load(name)


def view_clip(clip: Clip) -> ViewedMotion:
    """The motion of a clip on its own skeleton."""
    if not len(clip):
        raise BadInput(f"{clip.name} has no frames.", "Choose another clip.")
    pose = forward_kinematics(clip.skeleton, clip.root_m, clip.world_from_root, clip.angles_rad)
    joints_m = np.concatenate([clip.root_m[:, None], pose.end_m], axis=1)
    track = PlayerTrack(clip.name, joints_m, np.zeros(len(clip), dtype=np.int64))
    heading_rad = rotations.mean_heading_rad(clip.world_from_root)
    shown = PlayerClip(clip.name, clip.name, np.arange(len(clip)) / clip.rate_hz, heading_rad, track)
    title = f"{clip.name}, {clip.duration_s:.1f} s at {clip.rate_hz:g} Hz"
    return ViewedMotion(title, clip.skeleton, [clip.name], lambda _: shown, "; ".join(clip.notes))


def _view_run(folder: Path, methods: Sequence[str] | None) -> ViewedMotion:
    """The clips of a run, each read when it is first looked at; UnknownName for a method that the run lacks."""
    from harness.report.run.data import read_summary_only
    from harness.report.run.player_data import group_rows, make_clip
    from harness.results.files import require_kind

    require_kind(folder, "run")
    run = read_summary_only(folder)
    for name in methods or ():
        if name not in run.series:
            raise UnknownName("method of this run", name, run.series)
    clips = group_rows(run)
    if methods:
        chosen = {name: {m: rows[m] for m in methods if m in rows} for name, rows in clips.items()}
        clips = {name: rows for name, rows in chosen.items() if rows}
    if not clips:
        raise BadFile(folder, "no frames with an estimate", "a run with a measured cell", "Run it again.")
    names = list(clips)

    def make(number: int) -> PlayerClip:
        clip = make_clip(run, names[number], clips[names[number]], run.cell, 1)
        order = {name: n for n, name in enumerate(methods or run.ranked)}
        estimates = sorted(clip.estimates, key=lambda track: order[track.name])
        return PlayerClip(clip.name, clip.title, clip.time_s, clip.heading_rad, clip.truth, estimates, clip.stations)

    return ViewedMotion(f"{run.name}: {folder}", standard_skeleton(), names, make, shown=methods or ())


def _view_recording(
    path: Path,
    methods: Sequence[str],
    playback_options: dict[str, Any],
    mocap: LibraryFolders | None,
    progress: ProgressCallback,
) -> ViewedMotion:
    """The readings of a recording, with the truth and the estimates where the played scenario is known."""
    from harness.experiment import check_methods, evaluate_each, find_playback, recorded_take
    from harness.score import compute_poses
    from harness.simulate import WORLD_FROM_TRACKER, TrackerConfig
    from harness.stream.recording import RecordingStream

    stream = RecordingStream(path)
    lost = [f"Lost: {text}." for text in stream.recording.damage]
    known = playback_options.get("scenario") is not None or "scenario" in stream.recording.note
    if not known:
        if methods:
            found = f"Nothing says what {path} was played from, so methods have no body and no mounts."
            raise BadInput(found, "Name the scenario with --scenario.")
        frames = tuple(stream)
        _require_frames(path, len(frames))
        note = "The room is not known: the tracker's frame is shown as if it hung 2.5 m above the floor."
        stations = _stations(stream.stations, frames, WORLD_FROM_TRACKER, np.array(TrackerConfig().origin_m))
        clip = PlayerClip(path.name, path.name, _times_s(frames), 0.0, None, (), stations)
        return ViewedMotion(path.name, standard_skeleton(), [path.name], lambda _: clip, " ".join([note, *lost]))
    playback = find_playback(stream, **playback_options, folder=mocap)
    check_methods(methods)
    take = recorded_take(stream, playback)
    evaluations = evaluate_each(methods, take, progress=progress)
    lost += [f"{one.method} failed: {one.failure.strip().splitlines()[-1]}." for one in evaluations if one.failure]
    evaluations = [one for one in evaluations if not one.failure]
    count = len(take.frames)
    _require_frames(path, count)
    truth = take.truth.at(np.maximum(take.truth_row, 0))
    truth_states = np.where(take.truth_row < 0, NO_ESTIMATE, 0)
    tracks = []
    for one in evaluations:
        poses = compute_poses(playback.performer_calibration.body.skeleton, one.answers.qpos)
        joints_m = np.full((count, *poses.joints_m.shape[1:]), np.nan)
        joints_m[: len(poses.joints_m)] = poses.joints_m
        states = np.full(count, NO_ESTIMATE)
        states[: len(poses.joints_m)] = one.answers.status
        region_deg, sigma_rad = np.full(count, np.nan), one.answers.angle_sigma_rad
        if sigma_rad is not None:
            region_deg[: len(sigma_rad)] = mean_region_deg(sigma_rad)
        region = None if sigma_rad is None else hold_last(region_deg)
        tracks.append(PlayerTrack(one.method, hold_last(joints_m), states, region))
    room = playback.calibration
    stations = _stations(stream.stations, take.frames, room.world_from_tracker, room.tracker_origin_m)
    heading_rad = rotations.mean_heading_rad(truth.world_from_root)
    true_track = PlayerTrack("truth", truth.joints_m, truth_states)
    clip = PlayerClip(path.name, path.name, _times_s(take.frames), heading_rad, true_track, tracks, stations)
    title = f"{path.name}: {playback.scenario.name}, {playback.clip_evaluation.part}"
    return ViewedMotion(
        title, standard_skeleton(), [path.name], lambda _: clip, " ".join(lost), [one.method for one in evaluations]
    )


def view_poses(found: "PoseRecording") -> ViewedMotion:
    """The bodies of poses of another program in their own world; the note tells what was assumed about them."""
    from harness.stream.recording import PoseLogStream

    path = found.path
    stream = PoseLogStream(found.log)
    frames = tuple(stream)
    stations = _stations(stream.stations, frames, np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3))
    clip = PlayerClip(path.name, path.name, _times_s(frames), 0.0, None, (), stations)
    assumed = [f"{finding}." for finding in found.log.findings if finding.assumed]
    note = " ".join(["The world is that of the file.", *assumed, *(f"Lost: {text}." for text in found.damage)])
    return ViewedMotion(path.name, standard_skeleton(), [path.name], lambda _: clip, note)


def _require_frames(path: Path, count: int) -> None:
    if not count:
        raise BadFile(path, "no frames", "a recording with frames", "`harness replay FILE` prints what it holds.")


def _times_s(frames: "Sequence[TrackerFrame]") -> Floats:
    received_s = np.array([frame.received_s for frame in frames])
    out: Floats = received_s - received_s[0]
    return out


def _stations(
    names: Sequence[str], frames: "Sequence[TrackerFrame]", world_from_tracker: Floats, origin_m: Floats
) -> PlayerStations:
    """The readings in the world; missing ones stay where they were last."""
    position_m = np.array([frame.position_m for frame in frames])
    orientation = np.array([frame.tracker_from_station for frame in frames])
    position = np.array([frame.position_valid for frame in frames])
    oriented = np.array([frame.orientation_valid for frame in frames])
    lacks = np.stack([~position & np.max(position, axis=0), ~oriented & np.max(oriented, axis=0)])
    states = np.where(position | oriented, np.where(lacks.any(axis=0), 1, 0), 2)
    placed_m, turned = np.empty_like(position_m), np.empty_like(orientation)
    for n in range(len(names)):
        placed_m[:, n] = rotations.rotate(world_from_tracker, hold_last(position_m[:, n])) + origin_m
        turned[:, n] = rotations.multiply(world_from_tracker, _unit_or_none(hold_last(orientation[:, n])))
    quality = np.nan_to_num(np.array([frame.quality for frame in frames]))
    return PlayerStations(tuple(names), placed_m, turned, states, quality)


def _unit_or_none(quaternions: Floats) -> Floats:
    """Quaternions (F, 4), with the identity in place of zeros: a station that never had an orientation."""
    known = np.max(np.abs(quaternions), axis=1, keepdims=True) > 0.0
    out: Floats = np.where(known, quaternions, [1.0, 0.0, 0.0, 0.0])
    return out
