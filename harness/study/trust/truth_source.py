"""The reference that a user names for a capture: found and read once, whatever kind it is of."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from harness.errors import BadFile, BadInput, NotComparable, UnknownName
from harness.experiment import find_playback
from harness.experiment.scenarios import Scenario, load_scenario
from harness.measure import TruthSpline, coarse_offset
from harness.mocap import CLIP_FORMATS, LibraryFolders, read_clip
from harness.stream import PoseFileOptions, PoseLog
from harness.stream.recording import CaptureReader
from harness.study.trust.capture_readings import CaptureReadings, measured_poses, read_capture
from harness.study.trust.logged_poses import truth_of_log
from harness.study.trust.marker_poses import MARKER_SUFFIX, read_marker_poses
from harness.study.trust.pose_source import holds_poses, read_poses
from harness.study.trust.truth_motion import TruthMotion, truth_of_capture, truth_of_clip, truth_of_playback

_POSE_SUFFIXES = (".tum", ".csv", ".txt")
_LOOPED_CORRELATION = 0.8
"""Least correlation of angular speeds with which a capture shows a clip again and again [choice]."""


@dataclass(frozen=True)
class TruthSource:
    """Where the reference of a capture is."""

    name: str
    """A capture, poses of another program, a C3D or motion file, or a clip of a scenario."""
    scenario: str | None = None
    """Scenario with the stations and mounts of a clip; by default that of the capture's note."""
    folder: LibraryFolders | None = None
    """Folders of real motion."""
    options: PoseFileOptions = field(default_factory=PoseFileOptions)
    """What the user knows about a file of poses."""


def load_truth(capture: CaptureReadings, source: TruthSource) -> TruthMotion:
    """The reference of a capture. BadFile, BadInput and UnknownName that name what is missing."""
    path, stations, options = Path(source.name), capture.stations, source.options
    suffix = path.suffix.lower()
    if path.is_dir():
        return truth_of_log(_read_folder(path, stations, options), stations)
    if suffix == MARKER_SUFFIX:
        markers = read_marker_poses(path, options)
        return truth_of_log(markers.log, stations, markers.noise)
    if holds_poses(path) or suffix in _POSE_SUFFIXES:
        return truth_of_log(read_poses([path], options).log, stations)
    if options != PoseFileOptions():
        raise BadInput(f"--unit or the like with {source.name}.", "It is for poses of another program: leave it out.")
    if suffix.lstrip(".") in (*CLIP_FORMATS, "asf"):
        return truth_of_clip(read_clip(path), _scenario_of(capture, source), stations)
    if path.is_file():
        return truth_of_capture(read_capture(CaptureReader(path)), stations)
    try:
        return _truth_of_scenario(capture, source)
    except UnknownName as error:
        if error.name != source.name or not suffix:
            raise
        raise BadFile(path, "no such file", "a clip, or a file with a reference", "Check the path.") from error


def _read_folder(folder: Path, stations: Sequence[str], options: PoseFileOptions) -> PoseLog:
    """The poses of the files STATION.tum or TAKE.STATION.tum of a folder, or .csv or .txt. BadFile."""
    files: dict[str, Path] = {}
    for path in sorted(folder.iterdir()):
        for station in stations if path.suffix.lower() in _POSE_SUFFIXES else ():
            if f".{path.stem}".lower().endswith(f".{station}".lower()):
                if station in files:
                    found = f"{files[station].name} and {path.name} of station {station!r}"
                    raise BadFile(folder, found, "one file a station", "Move one of them.")
                files[station] = path
    if not files:
        raise BadFile(folder, "no file of a station", f"such as {stations[0]}.tum", "Look at the folder.")
    log = read_poses(list(files.values()), options).log
    if len(log.bodies) != len(files):
        raise BadFile(
            folder, f"{len(log.bodies)} bodies in {len(files)} files", "one a file", "Name such a file alone."
        )
    return replace(log, bodies=tuple(replace(b, name=name) for b, name in zip(log.bodies, files, strict=True)))


def _scenario_of(capture: CaptureReadings, source: TruthSource) -> Scenario:
    """The scenario with stations and mounts: the given one, or that of the capture's note. BadInput without one."""
    name = source.scenario or capture.note.get("scenario")
    if not isinstance(name, str):
        where = f"Nothing says where the stations are worn in {Path(source.name).name}."
        raise BadInput(where, "Name a scenario with --scenario.")
    return load_scenario(name)


def _truth_of_scenario(capture: CaptureReadings, source: TruthSource) -> TruthMotion:
    """A clip that the simulator or an emulator played, or that a performer did once."""
    playback = find_playback(capture, scenario=source.scenario, clip=source.name, folder=source.folder)
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
