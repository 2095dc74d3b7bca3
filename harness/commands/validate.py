"""The verb `validate`: compare a capture with a reference that was recorded beside it."""

import argparse
from pathlib import Path

from harness.commands.common import Verbs, add_verb, print_caveat, print_result, this_command
from harness.core.progress import ProgressBar, show_steps
from harness.errors import BadInput, Outcome


def add_validate(verbs: Verbs) -> None:
    text = "register a capture with a reference, and measure errors, clocks, room and mounts against it"
    verb = add_verb(verbs, "validate", text, run_validate, "mocap")
    verb.add_argument("capture", type=Path, help="a recording by `harness record` or `harness characterize`")
    text = (
        "the reference: a clip of the capture's scenario or of a library, another capture, a C3D file with three or "
        "more markers a station (head_1, head_2, head_3), a TUM file or folder with NAME.tum, or a CSV table"
    )
    verb.add_argument("--truth", required=True, metavar="CLIP|FILE", help=text)
    verb.add_argument(
        "--scenario", metavar="NAME", help="clip: scenario with stations and mounts (default: the capture's)"
    )
    verb.add_argument(
        "--methods", metavar="A,B", help="clip: methods to reconstruct and score with what was registered"
    )
    text = "earlier unit file to compare with (default: the noise preset `default`)"
    verb.add_argument("--expect", type=Path, metavar="FILE", help=text)
    text = "unit file to write: that of --expect, or the preset, with what the reference showed; the page is beside it"
    verb.add_argument("--out", type=Path, metavar="FILE", help=text)
    verb.add_argument("--force", action="store_true", help="replace a unit file that exists")


def run_validate(args: argparse.Namespace) -> Outcome:
    from harness.core.files import require_writable
    from harness.core.options import split_outside_brackets
    from harness.measure.unit_file import UNIT_FILE, read_unit_file, write_unit_file
    from harness.report.kit.page_html import write_page
    from harness.report.kit.page_text import page_text
    from harness.report.lab.validation_page import validation_page
    from harness.study.trust.validation import evaluate_registered, load_truth, session_unit, validate_capture

    if args.out is not None:
        require_writable(args.out, UNIT_FILE, force=args.force)
    expected = None if args.expect is None else read_unit_file(args.expect)
    print_caveat(args.expect, expected.caveat if expected else "")
    truth = load_truth(args.capture, args.truth, scenario=args.scenario, folder=args.mocap)
    methods = split_outside_brackets(args.methods, ",") if args.methods else []
    if methods and truth.playback is None:
        raise BadInput(
            f"--methods with {truth.title}.", "Only a clip has a performer's body to score on: leave it out."
        )
    with ProgressBar("steps") as progress:
        found = validate_capture(args.capture, truth, expected=expected, progress=progress)
        scores = evaluate_registered(args.capture, found, methods, progress) if methods else []
    report = found.report
    errors = {one.method: {metric: one.metrics[metric] for metric in one.names} for one in scores}
    page = validation_page(report, errors, this_command())
    content = {
        "truth": truth.title,
        "matched_share": report.matched_share,
        "numbers": {key: number.as_dict() for key, number in report.numbers.items()},
        "exchanged": dict(found.exchanged),
        "departures": [
            {
                "key": check.key,
                "station": check.station,
                "measured": check.measured.as_dict(),
                "expected": check.expected.as_dict(),
                "p_holm": check.p_holm,
            }
            for check in found.named
        ],
        "scores": [
            {"method": method, "metric": metric, "value": value}
            for method, values in errors.items()
            for metric, value in values.items()
        ],
        "damage": list(found.reader.damage),
    }
    lines = [page_text(page)]
    if args.out is not None:
        write_unit_file(args.out, session_unit(found, expected, args.out.stem), force=args.force)
        with show_steps("parts of the report"):
            file = write_page(page, args.out.with_suffix(".html"))
        lines += [f"unit file: {args.out}", f"report: {file}"]
        content |= {"unit_file": str(args.out), "page": str(file)}
    failures = {one.method: one.failure for one in scores if one.failure}
    lines += [f"failed: {name}: {text.strip().splitlines()[-1]}" for name, text in failures.items()]
    content |= {"failures": failures} if failures else {}
    return print_result(args, content, *lines, outcome=Outcome.INCOMPLETE if failures else Outcome.PASS)
