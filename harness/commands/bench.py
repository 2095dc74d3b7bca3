"""The verb `bench`: measure speed, accuracy against stored errors, or the physics against published figures."""

import argparse
import sys
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.commands.common import (
    Verbs,
    add_verb,
    positive_int,
    print_result,
    process_count,
    progress_note,
    this_command,
)
from harness.core.progress import ProgressBar, show_steps
from harness.errors import BadInput, Outcome

if TYPE_CHECKING:
    from harness.results.benchmark_statement import BenchmarkStatement

ACCURACY = "accuracy"
"""Name of the benchmark of accuracy, which runs alone."""
RANKING = "ranking"
"""Name of the comparison of rankings on built-in and on real motion, which runs alone."""
LAB = "lab"
"""Name of the benchmark of characterize, validate and trust."""
_ACCURACY_FLAGS = ("method", "seeds", "jobs", "out", "mocap", "baseline", "save", "quick")


def add_bench(verbs: Verbs) -> None:
    text = "measure speed on this machine, or a method's accuracy against stored errors"
    verb = add_verb(verbs, "bench", text, run_bench, "seed", "out", "mocap")
    text = (
        "methods, ik, index, outliers, wire, stream, physics, lab, gate, sweep, startup, performers "
        "(default: all); accuracy; or ranking: do methods and places rank alike on built-in and real motion?"
    )
    verb.add_argument("what", nargs="*", help=text)
    text = "methods: also a database of a million frames; wire: ten minutes per line"
    verb.add_argument("--large", action="store_true", help=text)
    verb.add_argument("--runs", type=positive_int, metavar="N", help="wire: number of runs (default 1)")
    text = (
        "instead of speed: physics holds the simulated errors to published figures and writes a page; lab looks for "
        "planted faults in captures, and goes on after a stop"
    )
    verb.add_argument("--truth", action="store_true", help=text)
    verb.add_argument("--method", metavar="NAME", help="accuracy: the method (default expert_map)")
    verb.add_argument(
        "--seeds",
        type=positive_int,
        metavar="N",
        help="number of seeds: accuracy (default 5), --truth of physics (20) and lab (100)",
    )
    text = "accuracy, ranking, --truth of lab: clips or captures computed at the same time (default 1)"
    verb.add_argument("--jobs", type=process_count, metavar="N", help=text)
    text = "accuracy: stored errors to compare with (default: those of dynamic_map of commit 40f3d61)"
    verb.add_argument("--baseline", type=Path, metavar="FILE", help=text)
    verb.add_argument("--save", type=Path, metavar="FILE", help="accuracy: store the errors of the method in FILE")
    text = "accuracy: one seed, three clips, no verdict (exit code 3); ranking: two performers, three methods and sets"
    verb.add_argument("--quick", action="store_true", default=None, help=text)


def run_bench(args: argparse.Namespace) -> Outcome:
    if args.truth:
        return _bench_lab_truth(args) if args.what == [LAB] else _bench_truth(args)
    if ACCURACY in args.what:
        return _bench_accuracy(args)
    if RANKING in args.what:
        return _bench_ranking(args)
    if given := [name for name in _ACCURACY_FLAGS if getattr(args, name) is not None]:
        raise BadInput(f"--{given[0]} is for accuracy alone.", "Name it: harness bench accuracy.")
    if args.runs and args.what and "wire" not in args.what:
        raise BadInput("--runs is for wire alone.", "Name it: harness bench wire --runs 10.")
    return _bench_speed(args)


def _bench_speed(args: argparse.Namespace) -> Outcome:
    from harness.bench.benchmarks import run_benchmarks

    with ProgressBar("benchmarks") as progress:
        seed = args.seed if args.seed is not None else 1
        names, runs = tuple(args.what), args.runs or 1
        rows, left_out = run_benchmarks(names, seed=seed, large=args.large, runs=runs, progress=progress)
    return _print_statements(args, rows, {"left_out": left_out}, left_out)


def _print_statements(
    args: argparse.Namespace,
    rows: "Sequence[BenchmarkStatement]",
    content: Mapping[str, Any],
    lines: Sequence[str] = (),
    reference: str = "reference, in the same run",
) -> Outcome:
    """Print the table of statements, then other lines, then the number of missed targets.

    The outcome is REGRESSED where a target is missed. Where none is, it is INCOMPLETE where benchmarks were left out.
    """
    from harness.report.kit.statement_lines import statement_lines
    from harness.results.benchmark_statement import count_missed, outcome_of

    content, outcome = {"rows": [row.as_dict() for row in rows], **content}, outcome_of(rows)
    if content.get("left_out") and outcome is not Outcome.REGRESSED:
        outcome = Outcome.INCOMPLETE
    table = statement_lines(rows, reference=reference) if rows else []
    return print_result(args, content, *table, *lines, count_missed(rows), outcome=outcome)


def _bench_truth(args: argparse.Namespace) -> Outcome:
    """Print the truth table of the physics and write its page."""
    from harness.bench.physics.comparison import compare_error_models
    from harness.bench.physics.error_statistics import LIMIT_M, MERGE_S, SEGMENT_S
    from harness.bench.physics.truth import SEEDS, truth_rows
    from harness.report.physics.error_comparison import ErrorModelComparison
    from harness.report.physics.writer import write_physics_page

    if args.what != ["physics"]:
        raise BadInput("--truth is for physics or lab alone.", "Run: harness bench physics --truth.")
    seeds, out = _truth_flags(args, SEEDS, "seeds", "out"), args.out or Path("results") / "physics"
    with ProgressBar("rows") as progress:
        rows = truth_rows(seeds, progress)
        models = compare_error_models(seeds, progress)
    comparison = ErrorModelComparison(models, tuple(rows), this_command(), LIMIT_M, MERGE_S, SEGMENT_S)
    with show_steps("parts of the report"):
        page = write_physics_page(out / "report.html", comparison)
    return _print_statements(args, rows, {"seeds": len(seeds), "page": str(page)}, [f"report: {page}"], "published")


def _bench_lab_truth(args: argparse.Namespace) -> Outcome:
    """Print the truth table of the lab's verbs."""
    from harness.bench.lab.truth import SEEDS, lab_truth_rows
    from harness.experiment.executors import process_executor

    seeds, out = _truth_flags(args, SEEDS, "seeds", "out", "jobs"), args.out or Path("results") / LAB
    with progress_note(out), ProgressBar("captures") as progress, process_executor(args.jobs or 1) as executor:
        rows = lab_truth_rows(seeds, out, executor, progress)
    return _print_statements(args, rows, {"seeds": len(seeds), "captures": str(out / "captures")})


def _truth_flags(args: argparse.Namespace, seeds: tuple[int, ...], *allowed: str) -> tuple[int, ...]:
    """The seeds that a truth table is asked for; BadInput for flags that it does not have."""
    given = [name for name in _ACCURACY_FLAGS if name not in allowed and getattr(args, name) is not None]
    if args.large or args.runs or args.seed is not None or given:
        flags = {"seeds": "--seeds N", "out": "--out FOLDER", "jobs": "--jobs N"}
        listed = " and ".join(flags[name] for name in allowed)
        raise BadInput(f"--truth of {args.what[0]} takes {listed} alone.", "Leave the other flags out.")
    if args.seeds and args.seeds > len(seeds):
        raise BadInput(f"--seeds {args.seeds}: there are {len(seeds)} seeds.", "Name fewer.")
    return seeds[: args.seeds]


def _bench_accuracy(args: argparse.Namespace) -> Outcome:
    from harness.bench.accuracy.clip_errors import DEFAULT_BASELINE, StoredErrors, read_errors, write_errors
    from harness.bench.accuracy.conditions import DEFAULT_METHOD, SEEDS
    from harness.bench.accuracy.measurement import clean_commit, measure_accuracy
    from harness.bench.accuracy.text import format_report, report_content
    from harness.experiment.executors import process_executor

    if args.what != [ACCURACY] or args.large or args.runs or args.seed is not None:
        raise BadInput(
            "accuracy runs alone, without --large, --runs and --seed.", "Give --seeds N for the first N seeds."
        )
    if args.quick and (args.save or args.seeds):
        raise BadInput("--quick has one seed and few clips.", "Leave out --save and --seeds, or leave out --quick.")
    jobs, seeds, out = args.jobs or 1, SEEDS[: args.seeds], args.out or Path("results") / ACCURACY
    if args.seeds and args.seeds > len(SEEDS):
        raise BadInput(f"--seeds {args.seeds}: there are {len(SEEDS)} seeds.", "Name fewer.")
    commit = clean_commit() if args.save else ""
    stored, method = read_errors(args.baseline or DEFAULT_BASELINE), args.method or DEFAULT_METHOD
    with (
        progress_note(out),
        ProgressBar("cells") as bar,
        redirect_stdout(sys.stderr),  # a method may print; stdout is for data
        process_executor(jobs) as executor,
    ):
        report = measure_accuracy(
            method,
            stored,
            out,
            seeds=seeds,
            quick=bool(args.quick),
            folder=args.mocap,
            executor=executor,
            workers=jobs,
            command=this_command(),
            progress=bar,
        )
    if args.save and not report.failures:
        write_errors(args.save, StoredErrors(method, commit, seeds, report.by_method[method]))
    return print_result(args, report_content(report), format_report(report), outcome=report.outcome)


def _bench_ranking(args: argparse.Namespace) -> Outcome:
    from harness.bench.ranking.measurement import measure_rankings, plan_rankings
    from harness.bench.ranking.text import format_rankings, rankings_content
    from harness.experiment.executors import process_executor

    others = (args.seed, args.method, args.seeds, args.baseline, args.save, args.runs)
    if args.what != [RANKING] or args.large or any(value is not None for value in others):
        raise BadInput("ranking takes --quick, --jobs, --out and --mocap alone.", "Leave the other words out.")
    jobs, out = args.jobs or 1, args.out or Path("results") / RANKING
    with (
        progress_note(out),
        ProgressBar("cells") as bar,
        redirect_stdout(sys.stderr),  # a method may print; stdout is for data
        process_executor(jobs) as executor,
    ):
        report = measure_rankings(
            plan_rankings(quick=bool(args.quick)),
            out,
            folder=args.mocap,
            executor=executor,
            workers=jobs,
            command=this_command(),
            progress=bar,
        )
    return print_result(args, rankings_content(report), format_rankings(report), outcome=report.outcome)
