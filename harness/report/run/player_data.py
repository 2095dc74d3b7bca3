"""What the 3-D player of a run's page shows: every clip with truth, stations and the estimates of all methods."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.body import DEFAULT_MOUNTS, Mount, locate_mount
from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints
from harness.core.estimate import mean_region_deg
from harness.core.humanoid24 import standard_skeleton
from harness.report.kit.motion_player import (
    NO_ESTIMATE,
    PlayerClip,
    PlayerMoment,
    PlayerMotion,
    PlayerStations,
    PlayerTrack,
    hold_last,
)
from harness.report.run.data import Row, RunData, pose_pair
from harness.report.run.worst_window import WorstWindow, group_overlapping
from harness.results import Cell
from harness.score import PoseSequence

_MOST_FRAMES = 6_000
"""Estimated frames on a page, which take about 0.5 MB."""
_LOWEST_RATE_HZ = 20.0
"""Frames are left out down to this rate before clips are cut [choice]."""

CellReader = Callable[[str], Cell]
Windows = Mapping[tuple[str, str], WorstWindow]


def run_motion(run: RunData, windows: Windows, reader: CellReader) -> tuple[PlayerMotion, str]:
    """The motion to play, and a note on what was left out, "" if nothing was.

    `windows` has the worst seconds by series and metric; `reader` reads a cell by its key. All clips are shown whole
    where they have at most 6,000 frames in total. Else frames are left out, and if that is not enough, only the worst
    seconds are shown.
    """
    groups = group_rows(run)
    total = sum(int(row["frames_matched"]) for row in run.cells)
    rate_hz = max((float(row["rate_hz"]) for row in run.cells), default=0.0)
    most = max(1, int(rate_hz / _LOWEST_RATE_HZ))
    every = min(most, max(1, -(-total // _MOST_FRAMES)))
    worst = {name: _worst(windows, name) for name in run.ranked}
    if total > every * _MOST_FRAMES:
        return _worst_seconds(run, worst, reader, most)
    clips = [make_clip(run, name, rows, reader, every) for name, rows in groups.items()]
    names = list(groups)
    place = {str(row["key"]): names.index(name) for name, rows in groups.items() for row in rows.values()}
    moments = [
        _moment(run, series, group, place[group[0].key])
        for series, found in worst.items()
        for group in found
        if group[0].key in place
    ]
    note = f"Every {_ordinal(every)} frame is shown." if every > 1 else ""
    return PlayerMotion(standard_skeleton(), clips, moments), note


def _worst(windows: Windows, series: str) -> list[tuple[WorstWindow, ...]]:
    return group_overlapping(window for (name, _), window in windows.items() if name == series)


def _ordinal(n: int) -> str:
    return {2: "second", 3: "third"}.get(n, f"{n}th")


def group_rows(run: RunData) -> dict[str, dict[str, Row]]:
    """Clip -> series -> row. Clips with several seeds or noise presets are told apart by them."""
    varying = [key for key in ("scenario", "noise", "seed") if len({str(row[key]) for row in run.cells}) > 1]
    out: dict[str, dict[str, Row]] = {}
    for row in run.cells:
        if int(row["frames_matched"]):
            name = ", ".join([str(row["clip"]), *(f"{key} {row[key]}" for key in varying)])
            out.setdefault(name, {}).setdefault(run.series_of(row), row)
    return out


def _moment(run: RunData, series: str, windows: Sequence[WorstWindow], clip: int) -> PlayerMoment:
    worst, metrics = windows[0], ", ".join(window.metric for window in windows)
    title = f"{series}: {metrics} on {run.trace(worst.key).clip}, {worst.span}"
    return PlayerMoment(title, clip, series, worst.start_s, worst.end_s)


def _worst_seconds(
    run: RunData, worst: Mapping[str, Iterable[Sequence[WorstWindow]]], reader: CellReader, every: int
) -> tuple[PlayerMotion, str]:
    """Each method's worst seconds next to the leader, the best methods first, as many as fit."""
    groups = group_rows(run)
    clips: list[PlayerClip] = []
    moments: list[PlayerMoment] = []
    left, shown = _MOST_FRAMES, 0
    for series, found in worst.items():
        for group in found:
            key = group[0].key
            name, rows = next((n, r) for n, r in groups.items() if any(str(row["key"]) == key for row in r.values()))
            both = {other: rows[other] for other in dict.fromkeys((series, run.ranked[0])) if other in rows}
            clip = make_clip(run, f"{name}, {group[0].span}", both, reader, every, group[0])
            left -= len(clip.time_s) * len(both)
            if left < 0:
                break
            moments.append(_moment(run, series, group, len(clips)))
            clips.append(clip)
        if left < 0:
            break
        shown += 1
    note = "The run is too large to be shown whole: only the worst seconds of each method are shown"
    note += f", for {shown} of {len(worst)} methods." if shown < len(worst) else "."
    return PlayerMotion(standard_skeleton(), clips, moments), note


@dataclass(frozen=True, eq=False)
class _Frames:
    """The frames of one cell that are shown: their places on the clip's timeline, and their poses."""

    cell: Cell
    rows: Ints
    places: Ints
    truth: PoseSequence
    estimate: PoseSequence


def make_clip(
    run: RunData, name: str, rows: Mapping[str, Row], reader: CellReader, every: int, window: WorstWindow | None = None
) -> PlayerClip:
    """A clip with the estimates of some series, of every n-th frame, whole or of a window.

    Its timeline has the frames for which any of the series has an estimate.
    """
    cells = {series: reader(str(row["key"])) for series, row in rows.items()}
    times: dict[int, float] = {}
    for cell in cells.values():
        times |= dict(zip(cell.frame_index.tolist(), cell.time_s.tolist(), strict=True))
    index = np.array(sorted(times), dtype=np.int64)
    time_s = np.array([times[n] for n in index.tolist()])
    kept = np.ones(len(index), dtype=bool) if window is None else _within(time_s, window)
    index, time_s = index[kept][::every], time_s[kept][::every]
    frames = {series: _select(cell, index) for series, cell in cells.items()}
    first = next(iter(frames.values()))
    truth = PlayerTrack("truth", _spread(frames.values(), len(index)), np.zeros(len(index), dtype=np.int64))
    ranked = sorted(frames, key=run.ranked.index)
    estimates = [_estimate(series, frames[series], len(index)) for series in ranked]
    heading_rad = rotations.mean_heading_rad(first.truth.world_from_root)
    stations = _stations(list(frames.values()), len(index))
    return PlayerClip(name, name, time_s, heading_rad, truth, estimates, stations)


def _within(time_s: Floats, window: WorstWindow) -> Bools:
    out: Bools = (time_s >= window.start_s) & (time_s <= window.end_s)
    return out


def _select(cell: Cell, index: Ints) -> _Frames:
    rows = np.flatnonzero(np.isin(cell.frame_index, index) & np.isfinite(cell.estimate_qpos).all(axis=1))
    return _Frames(cell, rows, np.searchsorted(index, cell.frame_index[rows]), *pose_pair(cell, rows))


def _spread(frames: Iterable[_Frames], count: int) -> Floats:
    """(F, J, 3) true joint centres of all frames of a clip; frames that no cell has repeat their neighbour."""
    parts = list(frames)
    out = np.full((count, *parts[0].truth.joints_m.shape[1:]), np.nan)
    for part in parts:
        out[part.places] = part.truth.joints_m
    return hold_last(out)


def _estimate(series: str, frames: _Frames, count: int) -> PlayerTrack:
    joints_m = np.full((count, *frames.estimate.joints_m.shape[1:]), np.nan)
    joints_m[frames.places] = frames.estimate.joints_m
    states = np.full(count, NO_ESTIMATE)
    states[frames.places] = frames.cell.status[frames.rows]
    if (sigma_rad := frames.cell.angle_sigma_rad) is None:
        return PlayerTrack(series, hold_last(joints_m), states)
    region_deg = np.full(count, np.nan)
    region_deg[frames.places] = mean_region_deg(sigma_rad[frames.rows])
    return PlayerTrack(series, hold_last(joints_m), states, hold_last(region_deg))


def _stations(frames: Sequence[_Frames], count: int) -> PlayerStations | None:
    """The stations where they are on the true body: a run's folder holds no readings, only whether each was usable."""
    cell = frames[0].cell
    mounts = [_mount(cell, name) for name in cell.stations]
    known = [(n, mount) for n, mount in enumerate(mounts) if mount is not None]
    if not known:
        return None
    position_m = np.full((count, len(known), 3), np.nan)
    orientation = np.full((count, len(known), 4), np.nan)
    states, quality = np.full((count, len(known)), 2), np.zeros((count, len(known)))
    columns = [n for n, _ in known]
    for part in frames:
        states[part.places] = _states(part.cell)[part.rows][:, columns]
        quality[part.places] = part.cell.quality[part.rows][:, columns]
        for k, (_, mount) in enumerate(known):
            position_m[part.places, k], orientation[part.places, k] = station_poses(part.truth, mount)
    names = [cell.stations[n] for n in columns]
    return PlayerStations(names, hold_last(position_m), hold_last(orientation), states, quality)


def station_poses(motion: PoseSequence, mount: Mount) -> tuple[Floats, Floats]:
    """Positions (F, 3) [m] and orientations `world_from_station` (F, 4) of a station on a moving body."""
    origin_m, bone_from_station = locate_mount(motion.skeleton, mount)
    bone = motion.skeleton.index(mount.bone)
    start_m = motion.joints_m[:, motion.skeleton.parents[bone] + 1]
    world_from_bone = motion.world_from_bone[:, bone]
    orientation = rotations.multiply(rotations.from_matrix(world_from_bone), bone_from_station)
    return start_m + world_from_bone @ origin_m, orientation


def _mount(cell: Cell, station: str) -> Mount | None:
    """Where a station sits, by the conditions of the cell, or where a station of that name usually does."""
    placed = cell.defined_by.get("stations", {}).get(station)
    if placed is None:
        return DEFAULT_MOUNTS.get(station)
    return Mount(
        station,
        placed["bone"],
        float(placed["along"]),
        float(np.deg2rad(placed["around_deg"])),
        float(placed.get("stand_off_m", 0.01)),
    )


def _states(cell: Cell) -> Ints:
    """(F, S) 0 if everything that the station delivers was usable, 2 if nothing was, 1 between."""
    parts = [valid for valid in (cell.position_valid, cell.orientation_valid) if valid.any()]
    usable = np.array(parts) if parts else np.zeros((1, *cell.suspect.shape), dtype=bool)
    out: Ints = np.where(usable.all(axis=0), 0, np.where(usable.any(axis=0), 1, 2))
    return out
