"""The verb `validate`: compare a capture with a reference that was recorded beside it."""

import argparse
import math
from pathlib import Path

from harness.commands.flags import Verbs, add_verb, parse_pair, share, split_list
from harness.commands.output import print_result, this_command
from harness.commands.pose_flags import TRUTH_PREFIX, add_pose_flags, naming_truth_flags, pose_options
from harness.commands.unit_results import UnitOptions, add_unit_flags, departure_content, read_expected, write_unit
from harness.core.progress import ProgressBar
from harness.errors import BadInput, Outcome


def add_validate(verbs: Verbs) -> None:
    text = "register a capture with a reference, and measure errors, clocks, room and mounts against it"
    verb = add_verb(verbs, "validate", text, run_validate, "mocap")
    verb.add_argument("capture", type=Path, help="a recording, or a file of poses of another program")
    text = (
        "the reference: a clip of the capture's scenario or of a library, another capture, poses of another program "
        "(one file, or a folder with STATION.tum or .csv), or a C3D file with three or more markers a station"
    )
    verb.add_argument("--truth", required=True, metavar="CLIP|FILE", help=text)
    verb.add_argument(
        "--scenario", metavar="NAME", help="clip: scenario with stations and mounts (default: the capture's)"
    )
    verb.add_argument(
        "--methods", metavar="A,B", help="clip: methods to reconstruct and score with what was registered"
    )
    verb.add_argument("--stations", metavar="A,B", help="compare these stations only (default: all)")
    text = "smallest share of the records that must have a reference (default 0.95)"
    verb.add_argument("--least-matched", type=share, default=0.95, metavar="SHARE", help=text)
    text = "standard deviations of the reference's positions and orientations on each axis, which enter the intervals"
    verb.add_argument("--truth-noise", type=parse_pair, metavar="MM,DEG", help=text)
    add_pose_flags(verb)
    add_pose_flags(verb, prefix=TRUTH_PREFIX)
    text = "unit file to write: that of --expect, or the preset, with what the reference showed; the page is beside it"
    add_unit_flags(verb, text)


def run_validate(args: argparse.Namespace) -> Outcome:
    from harness.report.kit import render_text
    from harness.report.lab.validation_page import validation_page
    from harness.study.trust.logged_poses import open_capture
    from harness.study.trust.truth_source import TruthSource, load_truth
    from harness.study.trust.validation import ValidationOptions, evaluate_registered, session_unit, validate_capture

    options = UnitOptions(args.out, args.expect, args.force)
    with naming_truth_flags():
        source = TruthSource(args.truth, args.scenario, args.mocap, pose_options(args, prefix=TRUTH_PREFIX))
    methods = split_list(args.methods)
    expected = read_expected(options)
    with ProgressBar("steps") as progress:
        progress("reading", 0, 3)
        capture = open_capture(args.capture, pose_options(args))
        if args.stations:
            capture = capture.only(split_list(args.stations))
        with naming_truth_flags():
            truth = load_truth(capture, source)
        if methods and truth.playback is None:
            advice = "Only a clip has a performer's body to score on: leave it out."
            raise BadInput(f"--methods with {truth.title}.", advice)
        noise = None if args.truth_noise is None else (1e-3 * args.truth_noise[0], math.radians(args.truth_noise[1]))
        limits = ValidationOptions(args.least_matched, noise)
        found = validate_capture(capture, truth, expected=expected, options=limits, progress=progress)
        scores = evaluate_registered(found, methods, progress) if methods else []
    report = found.report
    errors = {one.method: {metric: one.metrics[metric] for metric in one.names} for one in scores}
    page = validation_page(report, errors, this_command())
    lines, written = write_unit(options, session_unit(found, expected, options.name), page)
    content = {
        "truth": truth.title,
        "matched_share": report.matched_share,
        "numbers": {key: number.as_dict() for key, number in report.numbers.items()},
        "explained": {
            station: {"position": place, "orientation": turn}
            for station, (place, turn) in found.registration.explained.items()
        },
        "exchanged": dict(found.exchanged),
        "departures": departure_content(found.named, "p_holm"),
        "scores": [
            {"method": method, "metric": metric, "value": value}
            for method, values in errors.items()
            for metric, value in values.items()
        ],
        "damage": list(capture.damage),
        **written,
    }
    failures = {one.method: one.failure for one in scores if one.failure}
    lines += [f"failed: {name}: {text.strip().splitlines()[-1]}" for name, text in failures.items()]
    content |= {"failures": failures} if failures else {}
    return print_result(
        args, content, render_text(page), *lines, outcome=Outcome.INCOMPLETE if failures else Outcome.PASS
    )
