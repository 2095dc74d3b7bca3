"""Scoring of a recording: methods reconstruct its frames, and their estimates are scored against the played motion.

Only motion that an emulator or the simulator played has a truth. A frame's true pose is found by the device's clock,
which counts from the beginning of the motion; later loops are folded back. The way back to the beginning of a loop has
no truth and is not scored. Neither is a frame whose readings differ from those of the motion.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.estimate import Estimate, as_estimate, name_with_lag
from harness.core.fields import check_entries
from harness.core.number_format import format_fixed
from harness.core.progress import ProgressCallback
from harness.core.text_table import Table
from harness.errors import BadFile, BadInput, HarnessError, RenamedKey, UnknownName
from harness.experiment.isolation import DEFAULT_ISOLATION
from harness.experiment.method_run import MethodAnswers, describe_failure, stack_estimates
from harness.experiment.playback import Playback, prepare_playback, select_stations
from harness.experiment.remote_method import resolve_method
from harness.experiment.scenario import Scenario, load_scenario
from harness.mocap.library import LibraryFolders
from harness.reconstruct.contract import Session
from harness.results.reported_metrics import TABLE_COLUMNS
from harness.results.sigma_table import sigma_lines
from harness.score.metrics import DEFINITIONS, FRAME_METRICS
from harness.score.score import COVERAGE_FLOOR, WARM_UP_S, Scores, pool_frames, score_estimate
from harness.score.timing import step_times_ms
from harness.score.uncertainty import SigmaSums, score_sigma
from harness.stream.codec.items import STATION_CHARACTERS
from harness.stream.codec.samples import DeviceSamples
from harness.stream.frame import TrackerFrame
from harness.stream.recording.recording import EXPECTED_FILE
from harness.stream.recording.replay import RecordingStream

POSITION_TOLERANCE_M = 0.01
"""Largest median distance of a frame's readings from the played ones; rounding on the wire is a hundredth of it [m]."""
RATE_TOLERANCE = 0.02
"""Relative tolerance within which a rate measured by the driver counts as the scenario's."""
MIN_MATCHED_SHARE = 0.5
"""Smallest share of frames that match the motion; with fewer the recording is of another motion (our choice)."""


@dataclass(frozen=True)
class RecordingScore:
    """Scores of one method on a recording."""

    method: str
    frames_matched: int
    """Number of frames with an estimate and a truth, after the warm-up."""
    frames_expected: int
    """Number of true frames between the first and last recorded frame of each loop, after the warm-up."""
    records_arrived: int
    """Number of records in the frames that have a truth."""
    records_expected: int
    """Number of records of all stations between the first and last recorded frame of each loop."""
    metrics: dict[str, float | None]
    """Metrics by the names of `Scores.metrics`, over all loops together; None is "not measured"."""
    lag: int = 0
    """Number of later frames that the method uses for each estimate."""
    sigma_scores: Mapping[str, float] = field(default_factory=dict)
    """Scores of the standard deviations (see `score.uncertainty`), over all loops; empty without them."""
    failure: str = ""
    """Why the method has no result, as for a failed cell; "" if it has one."""

    @property
    def title(self) -> str:
        """Name in tables, with the lag."""
        return name_with_lag(self.method, self.lag)

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def find_playback(
    stream: RecordingStream,
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
            f"Nothing says what {stream.recording.path} was played from.",
            "Only motion of a scenario has a truth: name it with --scenario, and --clip where it is not the first.",
        )
    shipped = load_scenario(played)
    read_hz = stream.wire.rate_hz
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


def checked_note(stream: RecordingStream) -> dict[str, Any]:
    """A recording's note without empty entries; BadFile when one that names the playback has another type."""
    note = {name: value for name, value in stream.recording.note.items() if value is not None}
    try:
        check_entries(note, {name: kind for name, kind in _NOTE_TYPES.items() if name in note}, "note")
    except (TypeError, HarnessError) as error:
        raise BadFile(stream.recording.path, str(error), EXPECTED_FILE, "Name the scenario with --scenario.") from error
    return note


def name_recorded_stations(
    stream: RecordingStream, scenario: Path | str, names: Sequence[str] | None = None
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


def has_station_names(stream: RecordingStream, scenario: Scenario) -> bool:
    """Whether a recording names its stations, and not only by the device's characters."""
    named = not set("".join(stream.stations).encode()) <= set(STATION_CHARACTERS)
    return named or bool(set(stream.stations) & set(scenario.worn_stations))


@dataclass(frozen=True, eq=False)
class LoopFrames:
    """Frames of one loop of the motion within one session of the line."""

    rows: Ints
    """(N,) indices of the recorded frames."""
    index: Ints
    """(N,) indices of the true frames, strictly increasing."""


_Output = MethodAnswers | str
"""Answers of one method to the first F frames of the recording, by frame; or why it failed."""


def score_methods(
    stream: RecordingStream,
    playback: Playback,
    methods: Sequence[str],
    progress: ProgressCallback = lambda step, done, planned: None,
) -> list[RecordingScore]:
    """Run methods over a recording, side by side, at its speed, and score them; BadInput for another motion.

    A method that fails has its `RecordingScore.failure`, and stops no other.
    """
    frames, zero_s, made = _run_methods(stream, _begin_sessions(playback, methods, progress))
    loops = _split_into_loops(frames, zero_s, playback.samples)
    arrived = np.array([np.isfinite(frame.measured_s).sum() for frame in frames], dtype=np.int64)
    return [_score_method(name, made[name], loops, arrived, playback) for name in methods]


@dataclass(frozen=True, eq=False)
class MatchedRecording:
    """F frames of a recording, and the loops of those that have a truth."""

    frames: tuple[TrackerFrame, ...]
    loops: tuple[LoopFrames, ...]


def match_recording(stream: RecordingStream, playback: Playback) -> MatchedRecording:
    """Decode a recording once, for any number of methods; BadInput for another motion."""
    frames, zero_s, _ = _run_methods(stream, {})
    return MatchedRecording(tuple(frames), tuple(_split_into_loops(frames, zero_s, playback.samples)))


@dataclass(frozen=True, eq=False)
class ReconstructedRecording:
    """F frames of a recording with their truth and the estimates of methods."""

    frames: tuple[TrackerFrame, ...]
    truth_row: Ints
    """(F,) row of the true pose in `Playback.simulation.truth_qpos`; -1 where there is none."""
    estimates: Mapping[str, tuple[Floats, Ints]]
    """Method -> configurations (N, 55) and status (N,) of the first N frames; N < F for a method with a lag."""
    failures: Mapping[str, str]
    """Method -> why it has no estimates."""


def reconstruct_recording(
    stream: RecordingStream,
    playback: Playback,
    methods: Sequence[str],
    progress: ProgressCallback = lambda step, done, planned: None,
) -> ReconstructedRecording:
    """Run methods over a recording, side by side, and find the truth of each frame; BadInput for another motion."""
    frames, zero_s, made = _run_methods(stream, _begin_sessions(playback, methods, progress))
    truth_row = np.full(len(frames), -1)
    for loop in _split_into_loops(frames, zero_s, playback.samples):
        truth_row[loop.rows] = loop.index
    failures = {name: output for name, output in made.items() if isinstance(output, str)}
    estimates = {name: (out.qpos, out.status) for name, out in made.items() if not isinstance(out, str)}
    return ReconstructedRecording(tuple(frames), truth_row, estimates, failures)


def _begin_sessions(playback: Playback, methods: Sequence[str], progress: ProgressCallback) -> dict[str, Session | str]:
    """The sessions of the methods, or why one fails; names and options that do not exist are refused."""
    sessions, planned = dict[str, Session | str](), len(methods) + 1
    for done, name in enumerate(methods):
        progress(f"learning {name}", done, planned)
        try:
            fitted = playback.clip_evaluation.fit_method(resolve_method(name, DEFAULT_ISOLATION), name)
            sessions[name] = fitted.begin(playback.calibration)
        except (UnknownName, RenamedKey, BadInput):
            raise
        except (Exception, SystemExit) as error:  # a method may raise anything: it fails alone
            sessions[name] = describe_failure(error)
    progress("playing the recording", len(methods), planned)
    return sessions


def _run_methods(
    stream: RecordingStream, sessions: Mapping[str, Session | str]
) -> tuple[list[TrackerFrame], Floats, dict[str, _Output]]:
    """The frames, the device time at which the device's clock was zero for each (F,) [s], and the methods' output."""
    frames, zero_s = [], []
    failures = {name: session for name, session in sessions.items() if isinstance(session, str)}
    running = {name: session for name, session in sessions.items() if not isinstance(session, str)}
    estimates: dict[str, list[Estimate]] = {name: [] for name in running}
    times_ms: dict[str, list[float]] = {name: [] for name in running}
    for frame in stream:
        frames.append(frame)
        zero_s.append(stream.device_zero_s)
        for name in [name for name in running if name not in failures]:
            seen, start = replace(frame), time.perf_counter()
            try:
                answer = running[name].step(seen)
                times_ms[name].append(1e3 * (time.perf_counter() - start))
                estimates[name].append(as_estimate(answer))
            except (Exception, SystemExit) as error:  # a method may raise anything: it fails alone
                failures[name] = describe_failure(error)
    made = {name: failures.get(name) or _stack_by_frame(estimates[name], times_ms[name]) for name in sessions}
    return frames, np.array(zero_s), made


def _stack_by_frame(estimates: Sequence[Estimate], step_ms: Sequence[float]) -> _Output:
    try:
        return stack_estimates(estimates, step_ms).by_frame()[0]
    except ValueError as error:
        return str(error)


def _split_into_loops(frames: Sequence[TrackerFrame], zero_s: Floats, samples: DeviceSamples) -> list[LoopFrames]:
    """Frames that have a truth, loop by loop; BadInput when the recording is of another motion."""
    shape = len(frames), len(samples.stations)
    sound = ~np.array([f.suspect for f in frames], bool).reshape(shape)
    stamp_s = np.array([f.measured_s for f in frames]).reshape(shape) - zero_s[:, None]
    since = (stamp_s - samples.device_s[0]) * (len(samples) / samples.device_loop_s)
    number = np.round(_row_medians(np.where(sound, since, np.nan)))
    timed = number >= 0.0
    lap, index = np.divmod(np.where(timed, number, 0.0).astype(np.int64), len(samples))
    in_take = timed & (index < samples.take_frames)
    position_m = np.array([f.position_m for f in frames]).reshape(*shape, 3)
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


def _score_method(
    name: str, output: _Output, loops: Sequence[LoopFrames], arrived: Ints, playback: Playback
) -> RecordingScore:
    """The score of a method, where enough frames and enough of the (F,) records that `arrived` in each are there."""
    records = sum(int(arrived[loop.rows].sum()) for loop in loops)
    sent = len(playback.samples.stations) * sum(int(loop.index[-1] - loop.index[0]) + 1 for loop in loops)
    if isinstance(output, str):
        return RecordingScore(name, 0, 0, records, sent, _not_measured(), failure=output)
    rate_hz, truth_qpos = playback.tracker.rate_hz, playback.simulation.truth_qpos
    skeleton, scores, expected, sigma = playback.body.skeleton, [], 0, list[SigmaSums]()
    for number, loop in enumerate(loops):
        first, last = int(loop.index[0]), int(loop.index[-1])
        warm_s = first / rate_hz + WARM_UP_S if number == 0 else 0.0
        kept = loop.rows < len(output.qpos)
        answered = LoopFrames(loop.rows[kept], loop.index[kept])
        scores.append(
            score_estimate(
                skeleton,
                rate_hz,
                truth_qpos,
                output.qpos[answered.rows],
                answered.index,
                output.status[answered.rows],
                output.step_ms[answered.rows],
                estimate_skeleton=playback.performer_calibration.body.skeleton,
                warm_up_s=warm_s,
            )
        )
        if output.angle_sigma_rad is not None:
            rows, index = (values[scores[-1].scored] for values in (answered.rows, answered.index))
            sigma.append(score_sigma(truth_qpos[index], output.qpos[rows], output.angle_sigma_rad[rows]))
        expected += max(last + 1 - max(first, int(np.ceil(warm_s * rate_hz - 1e-9))), 0)
    matched = sum(int(score.scored.sum()) for score in scores)
    complete = records >= COVERAGE_FLOOR * sent or playback.tracker.overload
    enough = expected > 0 and matched >= COVERAGE_FLOOR * expected and complete
    metrics = _pool_metrics(scores, output.step_ms[1:]) if enough else _not_measured()
    sigma_scores = sum(sigma[1:], start=sigma[0]).scores() if enough and sigma else {}
    lag = int(output.lag[-1]) if len(output.lag) else 0
    return RecordingScore(name, matched, expected, records, sent, metrics, lag, sigma_scores)


def _pool_metrics(scores: Sequence[Scores], step_ms: Floats) -> dict[str, float | None]:
    """Metrics of all loops together, from the errors of single frames."""
    measured = {
        name: pool_frames(
            np.concatenate([score.per_frame[name][score.scored] for score in scores]), DEFINITIONS[name].pool
        )
        for name in FRAME_METRICS
    }
    measured |= step_times_ms(step_ms)
    return {name: value if np.isfinite(value) else None for name, value in measured.items()}


def _not_measured() -> dict[str, float | None]:
    return dict.fromkeys([*FRAME_METRICS, *step_times_ms(np.zeros(0))])


def format_score_table(judged: Sequence[RecordingScore]) -> str:
    """A row for each method that did not fail, and a table of the standard deviations if a method states them.

    The failures follow, each with the last line of its reason, and a line if too few records arrived.
    """
    rows, done = [], [one for one in judged if not one.failure]
    for one in done:
        figures = [format_fixed(one.metrics[name], decimals) for _, name, decimals in TABLE_COLUMNS]
        rows.append([one.title, f"{one.frames_matched}/{one.frames_expected}", *figures])
    table = Table(["method", "matched", *(title for title, *_ in TABLE_COLUMNS)], rows)
    sigmas = sigma_lines(["method"], [([one.title], one.sigma_scores) for one in done])
    failed = [f"failed: {one.method}: {one.failure.strip().splitlines()[-1]}" for one in judged if one.failure]
    return "\n".join([*(table.lines() if done else []), *sigmas, *failed, *_missing_records(judged)])


def _missing_records(judged: Sequence[RecordingScore]) -> list[str]:
    """A line if fewer records arrived than let anything be measured, unless the recording's scenario allows it."""
    for one in judged:
        if one.records_arrived < COVERAGE_FLOOR * one.records_expected:
            arrived = f"{one.records_arrived:,} of {one.records_expected:,} records arrived"
            if any(value is not None for value in one.metrics.values()):
                return [f"{arrived}, which tracker.overload of the recording's scenario allows."]
            return [
                f"{arrived}: the line is too slow for the stations, or some were off. Record at a lower rate, a higher "
                "baud rate or with fewer stations. If the slow line is what the scenario studies, set tracker.overload "
                "= true in it."
            ]
    return []
