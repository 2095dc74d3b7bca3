"""The command line: a verb parses, calls one library function, and prints. stdout is data, stderr is talk."""

import argparse
import json
import os
import shlex
import sys
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

from harness import __version__
from harness.errors import BadInput, HarnessError, Outcome, was_interrupted
from harness.progress import ProgressBar

Verbs = Any  # argparse's subparsers object has no public type
Action = Callable[[argparse.Namespace], Outcome]


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb; the exit code says how it ended (see `errors.Outcome`)."""
    try:
        args = build_parser().parse_args(argv)
    except SystemExit as ended:  # argparse has said what is wrong, or helped
        if ended.code:
            word = Outcome.REFUSED.word
            print(json.dumps({"outcome": word}) if "--json" in (argv or sys.argv) else word)
        raise
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")  # before numpy is imported: times are of one core, --jobs uses the others
    sys.path.append(os.getcwd())  # a user's own method, as module:Class, may lie where they work
    try:
        outcome: Outcome = args.action(args)
        sys.stdout.flush()
    except HarnessError as error:
        print(f"harness: {error}", file=sys.stderr)
        outcome = error.outcome
        if args.json:
            print(json.dumps({"outcome": outcome.word, "error": str(error)}))
    except BrokenPipeError:  # the reader of our output went away, as `| head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return Outcome.PASS.exit_code
    except (KeyboardInterrupt, Exception) as error:
        if not was_interrupted(error):
            raise
        outcome = Outcome.INTERRUPTED
        print("harness: stopped; what was finished is kept, the same command goes on from there", file=sys.stderr)
        if args.json:
            print(json.dumps({"outcome": outcome.word}))
    if not args.json:
        print(outcome.word, flush=True)
    return outcome.exit_code


def build_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="harness",
        description="Judges systems that turn a few body-worn 6-DOF trackers into full-body motion.",
        epilog="Exit codes: 0 pass, 1 regressed, 2 refused, 3 not comparable, 4 incomplete, 130 interrupted.",
    )
    parser.add_argument("--version", action="version", version=f"harness {__version__}")
    verbs = parser.add_subparsers(title="verbs", metavar="VERB", required=True)
    for add in (
        add_demo,
        add_run,
        add_list,
        add_inspect,
        add_mocap,
        add_export,
        add_report,
        add_check,
        add_bench,
        add_doctor,
    ):
        add(verbs)
    return parser


def add_verb(verbs: Verbs, name: str, text: str, action: Action, *flags: str) -> argparse.ArgumentParser:
    """A verb with the flags it shares with others; they mean the same everywhere."""
    verb: argparse.ArgumentParser = verbs.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
    verb.set_defaults(action=action)
    verb.add_argument("--json", action="store_true", help="print JSON instead of text")
    if "seed" in flags:
        verb.add_argument("--seed", type=int, help="replaces the scenario's seed")
    if "out" in flags:
        verb.add_argument("--out", type=Path, metavar="DIR", help="folder to write")
    if "jobs" in flags:
        text = "clips at the same time (default 1; the demo's is 2)"
        verb.add_argument("--jobs", type=positive, default=1, metavar="N", help=text)
    if "mocap" in flags:
        text = "library of real motion (default: the HARNESS_MOCAP variable)"
        verb.add_argument("--mocap", type=Path, metavar="DIR", help=text)
    return verb


def positive(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no positive whole number")
    return int(text)


def add_demo(verbs: Verbs) -> None:
    text = "run the main job on built-in motion and write its report"
    verb = add_verb(verbs, "demo", text, run_scenario, "seed", "out", "jobs")
    verb.set_defaults(scenario="demo", mocap=None, methods=None, movie=False, report=True, jobs=2)


def add_run(verbs: Verbs) -> None:
    text = "run a scenario: every test clip, every method; resumes what was interrupted"
    verb = add_verb(verbs, "run", text, run_scenario, "seed", "out", "jobs", "mocap")
    verb.add_argument("scenario", help="a TOML file, or the name of a shipped one (see `harness list`)")
    text = "replaces the scenario's methods, such as ik,best_match+ik,my_module:MyMethod[option=3]"
    verb.add_argument("--methods", metavar="A,B", help=text)
    verb.add_argument("--movie", action="store_true", help="also write an mp4 of the worst cell of each method")
    verb.add_argument("--no-report", dest="report", action="store_false", help="leave out report.html and plots")


def run_scenario(args: argparse.Namespace) -> Outcome:
    from dataclasses import replace

    from harness import experiment
    from harness.config import check_scenario, load_scenario
    from harness.core.options import alternatives, split

    scenario = load_scenario(args.scenario)
    if args.seed is not None:
        scenario = replace(scenario, seed=args.seed)
    if args.methods is not None:
        named = (name for text in split(args.methods, ",") for name in alternatives(text))
        scenario = replace(scenario, methods=tuple(named))
        check_scenario(args.scenario, scenario)
    out = args.out or Path("results") / scenario.name
    with ProgressBar("cells") as bar, redirect_stdout(sys.stderr):  # what a method prints is talk
        outcome = experiment.run(scenario, out, folder=args.mocap, jobs=args.jobs, command=this_command(), progress=bar)
    page = None
    if args.report:
        from harness.report.report import write_report

        print("writing the report", file=sys.stderr)
        with ProgressBar("movies") as bar:
            page = write_report(out, movie=args.movie, progress=bar)
    print_run(args, out, page, outcome)
    return outcome


def print_run(args: argparse.Namespace, out: Path, page: Path | None, outcome: Outcome) -> None:
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    if args.json:
        print(json.dumps({**summary, "outcome": outcome.word, "out": str(out), "report": page and str(page)}))
        return
    from harness.report.text import table

    print(table(summary))
    print(f"report: {page}" if page else f"results: {out}")


def add_list(verbs: Verbs) -> None:
    add_verb(verbs, "list", "name the methods, scenarios, built-in takes and metrics", list_everything)


def list_everything(args: argparse.Namespace) -> Outcome:
    from harness.catalogue import catalogue

    content = catalogue()
    if args.json:
        print(json.dumps({**content, "outcome": Outcome.PASS.word}))
        return Outcome.PASS
    for title, entries in content.items():
        print(f"{title}:")
        width = max(len(name) for name in entries)
        for name, text in entries.items():
            print(f"  {name:<{width}}  {text}")
    return Outcome.PASS


def add_inspect(verbs: Verbs) -> None:
    verb = add_verb(verbs, "inspect", "say what a motion file is, and what is wrong with it", inspect_file, "mocap")
    verb.add_argument("file", type=Path)
    verb.add_argument("--rate", type=float, metavar="HZ", help="frames per second, for files that do not record it")
    verb.add_argument("--unit", metavar="M", type=float, help="metres per unit of length, where files do not record it")


def inspect_file(args: argparse.Namespace) -> Outcome:
    from harness.mocap.inspect import inspect_file as inspect
    from harness.mocap.sources import VARIABLE

    library = args.mocap or (Path(os.environ[VARIABLE]) if os.environ.get(VARIABLE) else None)
    found = inspect(args.file, rate_hz=args.rate, unit=args.unit, library=library)
    if args.json:
        print(json.dumps({**found.as_dict(), "outcome": Outcome.PASS.word}))
    else:
        print("\n".join(found.lines()))
    return Outcome.PASS


def add_mocap(verbs: Verbs) -> None:
    verb = verbs.add_parser("mocap", help="list or download real motion", description="Libraries of real motion.")
    inner = verb.add_subparsers(title="what to do", metavar="WHAT", required=True)
    add_verb(inner, "list", "name the clips of a library", list_library, "mocap")
    fetch = add_verb(inner, "fetch", "download clips of CMU's motion capture database", fetch_library)
    fetch.add_argument("database", choices=["cmu"])
    fetch.add_argument("--subjects", required=True, metavar="13,14", help="CMU's subject numbers")
    fetch.add_argument("--out", type=Path, default=Path("mocap"), metavar="DIR", help="where to (default mocap/)")
    fetch.add_argument("--url", help="another address of the same layout (a mirror)")


def list_library(args: argparse.Namespace) -> Outcome:
    from harness.mocap.library import MotionLibrary
    from harness.mocap.sources import library_folder

    entries = MotionLibrary(library_folder(args.mocap)).entries()
    if not entries:
        raise BadInput("There are no clips in it.", "Looked for .amc with .asf, .bvh, .npz and .c3d files.")
    if args.json:
        print(json.dumps({"clips": [entry.as_dict() for entry in entries], "outcome": Outcome.PASS.word}))
    else:
        print("\n".join(entry.line() for entry in entries))
    return Outcome.PASS


def fetch_library(args: argparse.Namespace) -> Outcome:
    from harness.mocap.fetch import fetch_cmu

    subjects = [s.strip() for s in args.subjects.split(",") if s.strip()]
    where = {"base_url": args.url} if args.url else {}
    with ProgressBar("files") as progress:
        files = fetch_cmu(subjects, args.out, progress=progress, **where)
    if args.json:
        print(json.dumps({"files": [str(f) for f in files], "outcome": Outcome.PASS.word}))
    else:
        print(f"{len(files)} files in {args.out}; use them with --mocap {args.out}")
    return Outcome.PASS


def add_export(verbs: Verbs) -> None:
    verb = add_verb(verbs, "export", "write truth and estimates of a run for other programs", export_run, "out")
    verb.add_argument("run", type=Path, help="folder written by `harness run`")
    verb.add_argument("--format", required=True, choices=["bvh", "trc", "csv", "tum"])
    verb.add_argument("--force", action="store_true", help="write over files that exist")


def export_run(args: argparse.Namespace) -> Outcome:
    from harness.mocap.export import export
    from harness.score.results import read_cells

    folder = args.out or args.run / "export" / args.format
    files = export(read_cells(args.run), args.format, folder, force=args.force)
    if args.json:
        print(json.dumps({"files": [str(f) for f in files], "outcome": Outcome.PASS.word}))
    else:
        print(f"{len(files)} files in {folder}")
    return Outcome.PASS


def add_report(verbs: Verbs) -> None:
    verb = add_verb(verbs, "report", "write the page and plots of a finished run again", report_run)
    verb.add_argument("run", type=Path, help="folder written by `harness run`")
    verb.add_argument("--movie", action="store_true", help="also write an mp4 of the worst cell of each method")


def report_run(args: argparse.Namespace) -> Outcome:
    from harness.report.report import write_report

    with ProgressBar("movies") as bar:
        page = write_report(args.run, movie=args.movie, progress=bar)
    print(json.dumps({"report": str(page), "outcome": Outcome.PASS.word}) if args.json else f"report: {page}")
    return Outcome.PASS


def add_bench(verbs: Verbs) -> None:
    verb = add_verb(verbs, "bench", "measure speed: ratios and medians of one run on this machine", run_bench, "seed")
    verb.add_argument("what", nargs="*", help="methods, ik, index, stream, load, startup (default: all)")
    verb.add_argument("--large", action="store_true", help="methods: also learn from a million frames (minutes)")


def run_bench(args: argparse.Namespace) -> Outcome:
    from harness.bench.bench import bench
    from harness.bench.rows import as_text

    with ProgressBar("benchmarks") as progress:
        seed = args.seed if args.seed is not None else 1
        rows, left_out = bench(tuple(args.what), seed=seed, large=args.large, progress=progress)
    outcome = Outcome.INCOMPLETE if left_out else Outcome.PASS
    if args.json:
        found = {"rows": [row.as_dict() for row in rows], "left_out": left_out, "outcome": outcome.word}
        print(json.dumps(found))
    else:
        print("\n".join([as_text(rows), *left_out]))
    return outcome


def add_check(verbs: Verbs) -> None:
    verb = add_verb(verbs, "check", "try methods for the contract: causality, lost stations, recovery", run_check)
    text = "names as in scenarios, or my_module:MyMethod (default: all that are registered)"
    verb.add_argument("methods", nargs="*", metavar="METHOD", help=text)


def run_check(args: argparse.Namespace) -> Outcome:
    from harness.reconstruct import registry
    from harness.testing.method_checks import Finding, examine
    from harness.testing.rules import RULES

    found: dict[str, list[Finding]] = {}
    with ProgressBar("rules") as bar, redirect_stdout(sys.stderr):  # what a method prints is talk
        methods = {name: registry.resolve(name) for name in args.methods or sorted(registry.methods())}
        for name, method in methods.items():
            found[name] = []
            for finding in examine(method):
                found[name].append(finding)
                bar(f"{name}: {finding.rule}", sum(map(len, found.values())), len(methods) * len(RULES))
    broken = any(not finding.ok for findings in found.values() for finding in findings)
    outcome = Outcome.REGRESSED if broken else Outcome.PASS
    if args.json:
        content = {name: [finding.as_dict() for finding in findings] for name, findings in found.items()}
        print(json.dumps({"methods": content, "outcome": outcome.word}))
        return outcome
    for name, findings in found.items():
        print(name)
        for finding in findings:
            print(f"  {'ok  ' if finding.ok else 'FAIL'}  {finding.rule}: {finding.seen}")
    return outcome


def add_doctor(verbs: Verbs) -> None:
    add_verb(verbs, "doctor", "check this installation: scores, methods, pictures, motion", run_doctor, "mocap")


def run_doctor(args: argparse.Namespace) -> Outcome:
    from harness.doctor import examine

    checks = examine(args.mocap)
    outcome = Outcome.PASS if all(check.ok for check in checks) else Outcome.REGRESSED
    if args.json:
        print(json.dumps({"checks": [check.as_dict() for check in checks], "outcome": outcome.word}))
    else:
        for check in checks:
            print(f"{'ok  ' if check.ok else 'FAIL'}  {check.name}: {check.detail}")
    return outcome


def this_command() -> str:
    """The command as typed, to print where it can be copied."""
    return shlex.join(["harness", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
