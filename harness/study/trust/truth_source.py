"""The reference that a user names for a capture: found and read once, whatever kind it is of."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.errors import BadFile, BadInput, NotComparable, UnknownName
from harness.experiment import find_playback
from harness.experiment.scenarios import Scenario, load_scenario
from harness.measure import TruthSpline, coarse_offset
from harness.mocap import CLIP_FORMATS, LibraryFolders, read_clip
from harness.stream import PoseLog
from harness.stream.recording import CaptureReader, RecordingStream, is_pose_file, open_poses
from harness.study.trust.capture_readings import CaptureReadings, measured_poses, read_capture
from harness.study.trust.logged_poses import truth_of_log
from harness.study.trust.marker_poses import read_marker_poses
from harness.study.trust.truth_files import TRAJECTORY_SUFFIXES, is_foreign_table, read_truth_file
from harness.study.trust.truth_motion import TruthMotion, truth_of_capture, truth_of_clip, truth_of_playback

_LOOPED_CORRELATION = 0.8
"""Least correlation of angular speeds with which a capture shows a clip again and again [choice]."""


@dataclass(frozen=True)
class TruthSource:
    """Where the reference of a capture is."""

    name: str
    """A capture, a C3D, TUM, CSV or motion file, or a clip of a scenario."""
    scenario: str | None = None
    """Scenario with the stations and mounts of a clip; by default that of the capture's note."""
    folder: LibraryFolders | None = None
    """Folders of real motion."""


def load_truth(capture: CaptureReadings, source: TruthSource) -> TruthMotion:
    """The reference of a capture. BadFile, BadInput and UnknownName that name what is missing."""
    path = Path(source.name)
    suffix = path.suffix.lower()
    if path.is_file() and (log := _read_log(path, capture)) is not None:
        return truth_of_log(log, capture.stations)
    if path.is_dir() or suffix in TRAJECTORY_SUFFIXES:
        return read_truth_file(path, capture.stations)
    if suffix.lstrip(".") in (*CLIP_FORMATS, "asf"):
        return truth_of_clip(read_clip(path), _scenario_of(capture, source), capture.stations)
    if path.is_file():
        return truth_of_capture(read_capture(CaptureReader(path)), capture.stations)
    try:
        return _truth_of_scenario(capture, source)
    except UnknownName as error:
        if error.name != source.name or not suffix:
            raise
        raise BadFile(path, "no such file", "a clip, or a file with a reference", "Check the path.") from error


def _read_log(path: Path, capture: CaptureReadings) -> PoseLog | None:
    """Poses of another program; None for a file of another kind, and for a table that names the capture's stations."""
    if path.suffix.lower() == ".c3d" and capture.wire is None:
        return read_marker_poses(path)
    if path.suffix.lower().lstrip(".") in (*CLIP_FORMATS, "asf", "c3d") or not is_pose_file(path):
        return None
    if capture.wire is not None and path.suffix.lower() in TRAJECTORY_SUFFIXES and not is_foreign_table(path):
        return None
    return open_poses([path]).log


def _scenario_of(capture: CaptureReadings, source: TruthSource) -> Scenario:
    """The scenario with stations and mounts: the given one, or that of the capture's note. BadInput without one."""
    name = source.scenario or capture.note.get("scenario")
    if not isinstance(name, str):
        where = f"Nothing says where the stations are worn in {Path(source.name).name}."
        raise BadInput(where, "Name a scenario with --scenario.")
    return load_scenario(name)


def _truth_of_scenario(capture: CaptureReadings, source: TruthSource) -> TruthMotion:
    """A clip that the simulator or an emulator played, or that a performer did once."""
    stream = RecordingStream(capture.path)
    playback = find_playback(stream, scenario=source.scenario, clip=source.name, folder=source.folder)
    if capture.note.get("source") == "simulation":
        return truth_of_playback(playback, capture.stations, host_clock=True)
    stamps_s = np.concatenate([one.stamp_s[np.isfinite(one.stamp_s)] for one in capture.readings.values()])
    if len(stamps_s):
        device_s = float(stamps_s.min()), float(stamps_s.max())
        loops = truth_of_playback(playback, capture.stations, host_clock=False, device_s=device_s)
        if _plays_in_loops(capture, loops):
            return loops
    return truth_of_playback(playback, capture.stations, host_clock=False)


def _plays_in_loops(capture: CaptureReadings, loops: TruthMotion) -> bool:
    """Whether the capture moves as an emulator that repeats the clip, not as a performer who did it once."""
    poses = {station: measured_poses(readings) for station, readings in capture.readings.items()}
    if not all(one.valid.any() for one in poses.values()):
        return False
    splines = {station: TruthSpline(loops.bodies[loops.body_of[station]]) for station in poses}
    try:
        found = coarse_offset(poses, splines)
    except NotComparable:
        return False
    return found.correlation >= _LOOPED_CORRELATION
