"""Takes from recordings: the motion that was played or performed, and the true pose of each frame.

- Motion that an emulator or the simulator played has a truth by the device's clock, which counts from the beginning of
  the motion, or by the positions where the device has no clock; later loops are folded back. The way back to the
  beginning of a loop has no truth. Neither has a frame whose readings differ from those of the motion.
- A capture of a performer has a truth where a registration relates its clock to that of a clip.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from scipy.spatial import cKDTree

from harness.core.arrays import Floats, Ints
from harness.core.calibration import Calibration
from harness.core.fields import check_entries
from harness.errors import BadFile, BadInput, HarnessError
from harness.experiment.observed_take import ObservedTake
from harness.experiment.playback import Playback, prepare_playback, select_stations
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.measure import Registration
from harness.mocap import LibraryFolders
from harness.score import WARM_UP_S, LoopFrames
from harness.simulate import sampling_times_s
from harness.stream import TrackerFrame, TrackerStream
from harness.stream.polhemus.codec import STATION_CHARACTERS, DeviceSamples
from harness.stream.recording import EXPECTED_FILE, RecordingStream

RATE_TOLERANCE = 0.02
"""Relative tolerance within which a rate measured by the driver counts as the scenario's."""
POSITION_TOLERANCE_M = 0.01
"""Largest median distance of a frame's readings from the played ones; rounding on the wire is a hundredth of it [m]."""
_MOST_ROUNDS_OFF, _STILL_M = 2.0, 3e-4
"""Rounds between the time of a frame and its reading, at most; a motion that positions on the wire do
not tell from rest [m] [choices]."""
MIN_MATCHED_SHARE = 0.5
"""Smallest share of frames that match the motion; with fewer the recording is of another motion (our choice)."""


class RecordedMotion(Protocol):
    """What a recording or a pose log says of its origin."""

    @property
    def path(self) -> Path: ...
    @property
    def note(self) -> Mapping[str, Any]: ...
    @property
    def stations(self) -> tuple[str, ...]: ...
    @property
    def rate_hz(self) -> float: ...


def find_playback(
    stream: RecordedMotion,
    *,
    scenario: str | None = None,
    names: Sequence[str] | None = None,
    clip: str | None = None,
    rate_hz: float | None = None,
    noise: str | None = None,
    seed: int | None = None,
    folder: LibraryFolders | None = None,
) -> Playback:
    """The playback that a recording was made of.

    Values given here take precedence over the recording's note, and that over what the driver read. `names` are those
    of the recorded stations. BadInput when nothing names the scenario; UnknownName and BadFile as for a run of it.
    """
    note = checked_note(stream) if scenario is None else {}
    played = scenario or note.get("scenario")
    if played is None:
        raise BadInput(
            f"Nothing says what {stream.path} was played from.",
            "Only motion of a scenario has a truth: name it with --scenario, and --clip where it is not the first.",
        )
    shipped = load_scenario(played)
    read_hz = stream.rate_hz
    measured = abs(read_hz / shipped.tracker.rate_hz - 1.0) < RATE_TOLERANCE
    return prepare_playback(
        played,
        clip=clip or note.get("clip"),
        stations=name_recorded_stations(stream, played, names),
        rate_hz=rate_hz or note.get("rate_hz") or (None if measured else read_hz),
        noise=noise or note.get("noise"),
        seed=seed if seed is not None else note.get("seed"),
        folder=folder,
        posing=bool(note.get("posing")),
    )


_NOTE_TYPES = {"scenario": str, "clip": str, "noise": str, "rate_hz": float, "seed": int, "posing": bool}


def checked_note(stream: RecordedMotion) -> dict[str, Any]:
    """A recording's note without empty entries; BadFile when one that names the playback has another type."""
    note = {name: value for name, value in stream.note.items() if value is not None}
    try:
        check_entries(note, {name: kind for name, kind in _NOTE_TYPES.items() if name in note}, "note")
    except (TypeError, HarnessError) as error:
        raise BadFile(stream.path, str(error), EXPECTED_FILE, "Name the scenario with --scenario.") from error
    return note


def name_recorded_stations(
    stream: RecordedMotion, scenario: Path | str, names: Sequence[str] | None = None
) -> tuple[str, ...]:
    """Station names of a recording in a scenario: the given names, else the recorded ones.

    If the driver knew no names, they are the scenario's first stations. BadInput for another number of names,
    UnknownName for names that the scenario lacks.
    """
    known, count = load_scenario(scenario), len(stream.stations)
    if names is not None:
        if len(names) != count:
            raise BadInput(
                f"{len(names)} names for {count} recorded stations: {', '.join(stream.stations)}.",
                "Name each of them, in this order.",
            )
        return tuple(select_stations(known, names))
    return tuple(select_stations(known, stream.stations if has_station_names(stream, known) else count))


def has_station_names(stream: RecordedMotion, scenario: Scenario) -> bool:
    """Whether a recording names its stations, and not only by the device's characters."""
    named = not set("".join(stream.stations).encode()) <= set(STATION_CHARACTERS)
    return named or bool(set(stream.stations) & set(scenario.worn_stations))


def recorded_take(stream: RecordingStream, playback: Playback) -> ObservedTake:
    """Decode a recording of played motion, at the stream's speed; BadInput for another motion."""
    frames, zero_s = list[TrackerFrame](), list[float]()
    for frame in stream:
        frames.append(frame)
        zero_s.append(stream.device_zero_s)
    loops = _split_into_loops(frames, np.array(zero_s), playback.samples)
    tracker, motion = playback.tracker, playback.take
    return ObservedTake(
        playback.clip_evaluation,
        motion,
        tuple(frames),
        playback.calibration,
        tuple(loops),
        sampling_times_s(motion.duration_s, tracker, len(stream.stations)),
        tracker.rate_hz,
        overload=tracker.overload,
    )


def registered_take(
    stream: TrackerStream,
    registration: Registration,
    playback: Playback,
    rate_hz: float,
    loop_s: float = math.inf,
) -> ObservedTake:
    """The frames of a capture inside the clip that it was registered with; methods receive the room and mounts found.

    A frame's true pose is that of the clip at the mean time of its stations. Of several loops, each of `loop_s` [s],
    the one with the most frames is taken. BadInput for a station without a mount, and for too few frames.
    """
    if missing := [name for name in stream.stations if name not in registration.mounts]:
        raise BadInput(f"{missing[0]} has no mount.", "Methods need the mount of every station of the capture.")
    mounts = [registration.mounts[name] for name in stream.stations]
    calibration = Calibration(
        kind="registered",
        stations=tuple(playback.scenario.stations),
        bones=tuple(mount.body for mount in mounts),
        mount_m=np.array([mount.position_m for mount in mounts]),
        bone_from_station=np.array([mount.body_from_station for mount in mounts]),
        world_from_tracker=registration.world_from_tracker,
        tracker_origin_m=registration.tracker_origin_m,
    )
    frames, motion = list(stream), playback.take
    stamps_s = registration.state.truth_time_s(np.array([frame.measured_s for frame in frames]))
    loop, time_s = np.divmod(_row_means(stamps_s), loop_s)
    inside = (time_s >= 0.0) & (time_s <= motion.duration_s)
    most = max(np.unique(loop[inside]), key=lambda number: int(np.sum(loop[inside] == number)), default=0.0)
    rows = np.flatnonzero(inside & (loop == most))
    if len(rows) < 2.0 * WARM_UP_S * rate_hz:
        raise BadInput(f"{len(rows)} frames lie inside the reference.", "Record the motion of the reference.")
    number, begin_s = frame_numbers(time_s[rows], rate_hz)
    kept = _strictly_increasing_rows(np.arange(len(rows)), number)
    rows, index = rows[kept], number[kept]
    known_s = stamps_s[rows] - (most * loop_s if most else 0.0)
    sample_s = np.repeat(begin_s + np.arange(index[-1] + 1.0)[:, None] / rate_hz, len(mounts), axis=1)
    sample_s[index] = np.where(np.isfinite(known_s), known_s, sample_s[index])
    return ObservedTake(
        playback.clip_evaluation,
        motion,
        tuple(frames[rows[0] : rows[-1] + 1]),
        calibration,
        (LoopFrames(rows - rows[0], index),),
        np.clip(sample_s, 0.0, motion.duration_s),
        rate_hz,
    )


def frame_numbers(time_s: Floats, rate_hz: float) -> tuple[Ints, float]:
    """Number of each frame (N,) in the grid of a rate that fits their times best, and the time of number 0 [s].

    Numbers count from the time zero. Jitter of less than half a period moves no frame into the place of another.
    """
    periods = time_s * rate_hz
    since = periods - periods[0]
    phase = periods[0] + float(np.median(since - np.round(since)))
    phase -= np.round(phase)
    return np.round(periods - phase).astype(np.int64), float(phase) / rate_hz


def _row_means(values: Floats) -> Floats:
    """Mean of each row (F,) of values (F, S) without NaN; NaN for a row of NaN."""
    known = np.isfinite(values)
    sums, counts = np.where(known, values, 0.0).sum(axis=1), known.sum(axis=1)
    out: Floats = np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
    return out


def _split_into_loops(frames: Sequence[TrackerFrame], zero_s: Floats, samples: DeviceSamples) -> list[LoopFrames]:
    """Frames that have a truth, loop by loop; BadInput when the recording is of another motion."""
    shape = len(frames), len(samples.stations)
    sound = ~np.array([f.suspect for f in frames], bool).reshape(shape)
    stamp_s = np.array([f.measured_s for f in frames]).reshape(shape) - zero_s[:, None]
    position_m = np.array([f.position_m for f in frames]).reshape(*shape, 3)
    if np.isfinite(stamp_s).any():
        since = (stamp_s - samples.device_s[0]) * (len(samples) / samples.device_loop_s)
        number = np.round(_row_medians(np.where(sound, since, np.nan)))
    else:
        number = _rounds_by_position(position_m, np.array([f.received_s for f in frames]), samples)
    timed = number >= 0.0
    lap, index = np.divmod(np.where(timed, number, 0.0).astype(np.int64), len(samples))
    in_take = timed & (index < samples.take_frames)
    off_m = _row_medians(np.where(sound, np.linalg.norm(position_m - samples.position_m[index], axis=2), np.nan))
    played = in_take & ~(off_m > POSITION_TOLERANCE_M)  # NaN: no positions are sent, or all stations are lost
    if not played.any() or played.sum() < MIN_MATCHED_SHARE * in_take.sum():
        raise BadInput(
            f"The recording is of another motion: {played.sum()} of {len(frames)} frames belong to this one.",
            "Name the scenario, clip, seed, noise and rate that it was played with.",
        )
    rows = np.flatnonzero(played)
    turns = np.flatnonzero((np.diff(lap[rows]) != 0) | (np.diff(zero_s[rows]) != 0.0)) + 1
    return [
        LoopFrames(part_rows, index[part_rows])
        for part_rows in (_strictly_increasing_rows(part, index) for part in np.split(rows, turns))
    ]


def _rounds_by_position(position_m: Floats, received_s: Floats, samples: DeviceSamples) -> Floats:
    """Number of the round (F,) that each frame plays, counted through the loops, for a device without a clock.

    The positions (F, S, 3) nearest to a frame's show the instant. Together they relate the times of reception (F,) to
    the motion. A frame at rest, without a station, or whose nearest instant is far from its time has that time's.
    """
    rows, count = np.isfinite(position_m).all(axis=(1, 2)), len(samples)
    if not rows.any():
        return np.full(len(position_m), np.nan)
    nearest = cKDTree(samples.position_m.reshape(count, -1)).query(position_m[rows].reshape(rows.sum(), -1))[1]
    since = received_s * (count / samples.loop_s)
    turn = np.exp(2j * np.pi * (nearest - since[rows]) / count)
    middle = np.mean(turn)
    ahead_rad = np.angle(middle) + np.median(np.angle(turn / middle))
    expected = since + count * ahead_rad / (2.0 * np.pi)
    number = np.round(expected)
    there_m = samples.position_m[number[rows].astype(np.int64) % count]
    still = np.abs(position_m[rows] - there_m).max(axis=(1, 2)) < _STILL_M
    near = nearest + count * np.round((expected[rows] - nearest) / count)
    number[rows] = np.where(still | (np.abs(near - expected[rows]) > _MOST_ROUNDS_OFF), number[rows], near)
    out: Floats = number - count * np.floor(number.min() / count)
    return out


def _strictly_increasing_rows(rows: Ints, index: Ints) -> Ints:
    """Rows whose index exceeds all before: the second part of a frame that arrived in two is left out."""
    highest = np.maximum.accumulate(np.append(-1, index[rows]))[:-1]
    out: Ints = rows[index[rows] > highest]
    return out


def _row_medians(values: Floats) -> Floats:
    """Median of each row (F,) of values (F, S) without NaN; NaN for a row of NaN."""
    some = np.isfinite(values).any(axis=1)
    out = np.full(len(values), np.nan)
    out[some] = np.nanmedian(values[some], axis=1)
    return out
