"""The verb `replay`: play a recording or poses as frames, and a recording into methods."""

import argparse
import json
import sys
from collections.abc import Sequence
from contextlib import ExitStack, redirect_stdout, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from harness.commands.flags import (
    Verbs,
    add_verb,
    add_vrpn_flag,
    parse_methods,
    parse_names,
    refuse_flags,
    repeat_flags,
)
from harness.commands.output import print_caveat, print_data, print_result, print_status
from harness.commands.pose_flags import OWN_POSE_FLAGS, POSE_FLAGS, add_pose_flags, pose_options
from harness.core.interrupts import defer_interrupts
from harness.core.number_format import format_fixed
from harness.core.progress import ProgressBar
from harness.errors import BadInput, Outcome

if TYPE_CHECKING:
    from harness.experiment import Evaluation, ObservedTake
    from harness.stream import StreamSummary
    from harness.stream.recording import PoseLogStream, Recording, RecordingStream, ReplaySpeed

_SCORING = ("methods", "scenario", "stations", "clip", "noise", "seed", "calibration")
"""Flags that ask for methods; with a recording --rate too."""

_POLL_S = 0.2
"""Interval at which the wait for a client can be interrupted [s]."""


def add_replay(verbs: Verbs) -> None:
    text = "play a recording into the decoder, or poses; with --methods, into methods, scored against the known motion"
    verb = add_verb(verbs, "replay", text, run_replay, "seed", "mocap")
    text = "recording written by `harness record`, or poses of another program (TUM, EuRoC, CSV, matrices)"
    verb.add_argument("file", type=Path, help=text)
    text = (
        "max (default), step (one frame per Enter), or a factor of the recorded speed, such as 1 (default with --vrpn) "
        "or 0.5"
    )
    verb.add_argument("--speed", metavar="SPEED", help=text)
    add_vrpn_flag(verb, "the recorded stations, from the first client on")
    verb.add_argument("--anywhere", action="store_true", help="open --vrpn to other computers too")
    text = "print every station of every frame, as CSV or as JSON lines"
    verb.add_argument("--frames", action="store_true", help=text)
    text = "methods to score, named as in scenarios, such as ik,dynamic_map"
    verb.add_argument("--methods", metavar="A,B", help=text)
    text = "scenario that was played, if the recording does not name it"
    verb.add_argument("--scenario", metavar="NAME", help=text)
    text = "names of the recorded stations, in their order (default: the recording's, or the scenario's first ones)"
    verb.add_argument("--stations", metavar="A,B", help=text)
    verb.add_argument("--clip", metavar="CLIP", help="clip that was played (default: the scenario's first)")
    verb.add_argument("--noise", metavar="PRESET", help="noise preset that was played (default: the scenario's)")
    text = "frames per second that were played (default: the scenario's)"
    verb.add_argument("--rate", type=float, metavar="HZ", help=text)
    text = "calibration of mounts, room and body for the methods, written by `harness calibrate` (default: the truth)"
    verb.add_argument("--calibration", type=Path, metavar="FILE", help=text)
    add_pose_flags(verb, shared=("rate",))


def run_replay(args: argparse.Namespace) -> Outcome:
    from harness.stream.recording import RecordingStream, parse_speed, read_recording
    from harness.study.trust.pose_source import holds_poses

    speed = parse_speed(args.speed or ("1" if args.vrpn else "max"))
    if args.anywhere and args.vrpn is None:
        raise BadInput("--anywhere without --vrpn.", "Name the tracker that is served: --vrpn NAME.")
    if args.vrpn is not None:
        refuse_flags(args, ("frames", *_SCORING), "with --vrpn", "It is for a replay that is not served: leave it out.")
    if holds_poses(args.file):
        return _replay_poses(args, speed)
    refuse_flags(args, OWN_POSE_FLAGS, f"with {args.file.name}", "It is for poses of another program: leave it out.")
    recording = read_recording(args.file)
    if recording.answers and not recording.formats:
        return _print_answers(args, recording)
    stream = RecordingStream(recording, speed)
    for lost in stream.recording.damage:
        print(f"lost: {lost}", file=sys.stderr)
    if args.vrpn is not None:
        return _serve_frames(args, stream)
    if any(getattr(args, name) is not None for name in (*_SCORING, "rate")):
        return _score_methods(args, stream)
    return _print_frames(args, stream)


def _serve_frames(args: argparse.Namespace, stream: "RecordingStream | PoseLogStream") -> Outcome:
    """Serve the frames to VRPN clients, from the first client on."""
    from harness.stream import UnixTimeEstimator
    from harness.stream.vrpn import RelayedStream, describe_sensors, open_server

    frames = 0
    with ExitStack() as opened:
        with defer_interrupts():
            server = opened.enter_context(open_server(args.vrpn, anywhere=args.anywhere, log=print_status))
        sensors = describe_sensors(stream.stations)
        print_status(f"VRPN: {server.names[0]} with the sensors {sensors}; waits for a client, Ctrl-C ends it")
        outcome = Outcome.INTERRUPTED
        with suppress(KeyboardInterrupt):
            while not server.wait_for_client(_POLL_S):
                pass
            times = UnixTimeEstimator(stream.wall_s)
            for _ in RelayedStream(stream, server, server.trackers[0], times):
                frames += 1
            outcome = Outcome.PASS
    counts = {"frames": frames, "reports": server.sent}
    return print_result(args, counts, f"{frames} frames, {server.sent} reports served", outcome=outcome)


def _print_answers(args: argparse.Namespace, recording: "Recording") -> Outcome:
    """Print the commands of a recording that has no frames."""
    from harness.stream.recording import format_exchanges

    content = {"frames": 0, "lost": recording.damage, "answers": recording.answers}
    return print_result(args, content, *format_exchanges(recording.answers))


def _replay_poses(args: argparse.Namespace, speed: "ReplaySpeed") -> Outcome:
    """Play poses of another program: frames alone, because nothing tells the body that carried them."""
    from harness.stream.recording import PoseLogStream
    from harness.study.trust.pose_source import read_poses

    advice = "Poses of another program name no performer, mounts or motion: leave it out."
    refuse_flags(args, _SCORING, f"with the poses of {args.file.name}", advice)
    found = read_poses([args.file], pose_options(args))
    for lost in found.damage:
        print(f"lost: {lost}", file=sys.stderr)
    stream = PoseLogStream(found.log, speed)
    if args.vrpn is not None:
        return _serve_frames(args, stream)
    if (summary := _play(args, stream)) is None:
        return Outcome.PASS
    findings = [str(finding) for finding in found.log.findings]
    content = {**summary.as_dict(), "lost": list(found.damage), "findings": findings}
    if args.frames and not args.json:  # the frames are the data
        print(summary, file=sys.stderr)
        return Outcome.PASS
    following = ["inspect", args.file, *repeat_flags(args, *POSE_FLAGS)]
    return print_result(args, content, str(summary), "", *findings, following=following)


def _play(args: argparse.Namespace, stream: "RecordingStream | PoseLogStream") -> "StreamSummary | None":
    """Play a stream, and print its frames with --frames; None when the reader of stdout has left."""
    from harness.stream import FRAME_COLUMNS, StreamSummary, format_csv_row, frame_rows

    summary = StreamSummary(stream.stations)
    if args.frames and not args.json:
        print_data(",".join(FRAME_COLUMNS) + "\n")
    for frame in stream:
        summary.add(frame)
        if args.frames:
            rows = frame_rows(frame, stream.stations, stream.wall_s(frame.received_s))
            texts = [json.dumps(row) if args.json else format_csv_row(row) for row in rows]
            if not print_data("".join(f"{text}\n" for text in texts)):
                return None
    return summary


def _print_frames(args: argparse.Namespace, stream: "RecordingStream") -> Outcome:
    from harness.stream.recording import format_exchanges

    if (summary := _play(args, stream)) is None:
        return Outcome.PASS
    recording = stream.recording
    content = {**summary.as_dict(), **stream.counts, "lost": recording.damage, "events": recording.events}
    content |= {"answers": recording.answers}
    lines = [
        str(summary),
        "",
        _format_counts(stream),
        *(f"{e['elapsed_s']:.3f} s: {e['text']}" for e in recording.events),
        *format_exchanges(recording.answers),
    ]
    if args.frames and not args.json:  # the frames are the data
        print(*lines, sep="\n", file=sys.stderr)
        return Outcome.PASS
    following = ["view", args.file]  # what was played is not known, so methods have no body and no mounts
    if "scenario" in recording.note:
        following = ["replay", args.file, "--methods", "ik,expert_map", *repeat_flags(args, "mocap")]
    return print_result(args, content, *lines, following=following)


def _format_counts(stream: "RecordingStream") -> str:
    counts = stream.counts
    beyond = counts["out_of_range"]
    return (
        f"set up {counts['sessions']} times; {counts['records']} records, {counts['garbage_bytes']} bytes outside "
        f"records; the device's clock was also reset {counts['clock_resets']} times"
        + (f"; {beyond} positions were beyond the range of the output list" if beyond else "")
    )


def _score_methods(args: argparse.Namespace, stream: "RecordingStream") -> Outcome:
    from harness.calibrate import read_calibration
    from harness.experiment import check_methods, evaluate_each, find_playback, has_station_names, recorded_take

    options = {
        "scenario": args.scenario,
        "names": None if args.stations is None else parse_names(args.stations),
        "clip": args.clip,
        "rate_hz": args.rate,
        "noise": args.noise,
        "seed": args.seed,
    }
    playback = find_playback(stream, **options, folder=args.mocap)
    if args.calibration is not None:
        kept = read_calibration(args.calibration)
        print_caveat(args.calibration, kept.caveat)
        named = args.stations is not None or has_station_names(stream, playback.scenario)
        playback = playback.with_calibration(kept, named=named, say=print_status)
    methods = playback.scenario.methods if args.methods is None else parse_methods(args.methods)
    with ProgressBar("steps") as bar, redirect_stdout(sys.stderr):  # a method may print; stdout is for data
        check_methods(methods)
        scores = evaluate_each(methods, recorded_take(stream, playback), progress=bar)
    played = f"{playback.scenario.name}, {playback.clip_evaluation.part}"
    content = {"scenario": playback.scenario.name, "clip": str(playback.clip_evaluation.part), **stream.counts}
    content |= {"lost": stream.recording.damage, "methods": [score.as_dict() for score in scores]}
    measured = any(score.metrics["joint_angle_mean_deg"] is not None for score in scores)
    outcome = Outcome.PASS if measured else Outcome.NOT_COMPARABLE
    outcome = Outcome.INCOMPLETE if any(score.failure for score in scores) else outcome
    return print_result(args, content, f"played from {played}", "", format_score_table(scores), outcome=outcome)


def format_score_table(evaluations: Sequence["Evaluation"]) -> str:
    """A row for each method that did not fail, and a table of the standard deviations if a method states them.

    The failures follow, each with the last line of its reason, and a line if too few records arrived.
    """
    from harness.core.text_table import Table
    from harness.report.run.metric_columns import TABLE_COLUMNS, sigma_lines

    rows, done = [], [one for one in evaluations if not one.failure]
    for one in done:
        figures = [format_fixed(one.metrics[name], decimals) for _, name, decimals in TABLE_COLUMNS]
        rows.append([one.title, f"{one.scores.matched}/{one.scores.expected}", *figures])
    table = Table(["method", "matched", *(title for title, *_ in TABLE_COLUMNS)], rows)
    sigmas = sigma_lines(["method"], [([one.title], one.sigma_scores) for one in done])
    failed = [f"failed: {one.method}: {one.failure.strip().splitlines()[-1]}" for one in evaluations if one.failure]
    missing = _missing_records(evaluations[0].take) if evaluations else []
    return "\n".join([*(table.lines() if done else []), *sigmas, *failed, *missing])


def _missing_records(take: "ObservedTake") -> list[str]:
    """A line if fewer records arrived than let anything be measured, unless the recording's scenario allows it."""
    from harness.score import COVERAGE_FLOOR

    if take.records_arrived >= COVERAGE_FLOOR * take.records_expected:
        return []
    arrived = f"{take.records_arrived:,} of {take.records_expected:,} records arrived"
    if take.overload:
        return [f"{arrived}, which tracker.overload of the recording's scenario allows."]
    return [
        f"{arrived}: the line is too slow for the stations, or some were off. Record at a lower rate, a higher baud "
        "rate or with fewer stations. If the slow line is what the scenario studies, set tracker.overload = true in it."
    ]
