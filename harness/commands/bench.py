"""The verb `bench`: measure speed, accuracy against stored errors, or the physics against published figures."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.commands.flags import (
    Verbs,
    add_verb,
    folder_of,
    output_file,
    positive_int,
    process_count,
    refuse_flags_of_others,
)
from harness.commands.output import long_work, print_result, this_command
from harness.core.progress import ProgressBar, show_steps
from harness.errors import BadInput, Outcome

if TYPE_CHECKING:
    from harness.results.findings import BenchmarkStatement

ACCURACY = "accuracy"
"""Name of the benchmark of accuracy, which runs alone."""
RANKING = "ranking"
"""Name of the comparison of rankings on built-in and on real motion, which runs alone."""
LAB = "lab"
"""Name of the benchmark of characterize, validate and trust."""
SPEED = "speed"
_FLAGS_BY_USE = {
    SPEED: ("seed", "large", "runs"),
    ACCURACY: ("method", "seeds", "jobs", "out", "mocap", "baseline", "save", "quick", "only", "force"),
    RANKING: ("quick", "jobs", "out", "mocap"),
    "physics --truth": ("seeds", "out"),
    "lab --truth": ("seeds", "out", "jobs"),
}
"""What is measured -> flags that apply to it."""


def add_bench(verbs: Verbs) -> None:
    text = "measure speed on this machine, or a method's accuracy against stored errors"
    verb = add_verb(verbs, "bench", text, run_bench, "seed", "out", "mocap", "force")
    text = (
        "methods, ik, index, outliers, wire, stream, physics, lab, gate, sweep, startup, performers, foreign "
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
    verb.add_argument("--save", type=output_file, metavar="FILE", help="accuracy: store the method's errors in FILE")
    text = "accuracy: only the noise presets of the accuracy tables, or only the set-ups of stations, line and faults"
    verb.add_argument("--only", choices=("presets", "setups"), help=text)
    text = "accuracy: one seed, three clips, no verdict (exit code 3); ranking: two performers, three methods and sets"
    verb.add_argument("--quick", action="store_true", default=None, help=text)


def run_bench(args: argparse.Namespace) -> Outcome:
    words = args.what
    use = next((word for word in words if word in (ACCURACY, RANKING)), SPEED)
    if args.truth:
        if words not in (["physics"], [LAB]):
            raise BadInput("--truth is for physics or lab alone.", "Run: harness bench physics --truth.")
        use = f"{words[0]} --truth"
    elif use is not SPEED and words != [use]:
        raise BadInput(f"{use} runs alone.", "Leave the other words out.")
    refuse_flags_of_others(args, _FLAGS_BY_USE, use)
    if args.runs and words and "wire" not in words:
        raise BadInput("--runs is for wire alone.", "Name it: harness bench wire --runs 10.")
    return {
        SPEED: _bench_speed,
        ACCURACY: _bench_accuracy,
        RANKING: _bench_ranking,
        "physics --truth": _bench_physics_truth,
        "lab --truth": _bench_lab_truth,
    }[use](args)


def _first_seeds(args: argparse.Namespace, seeds: tuple[int, ...]) -> tuple[int, ...]:
    """As many of the seeds as `--seeds` says, by default all."""
    if args.seeds and args.seeds > len(seeds):
        raise BadInput(f"--seeds {args.seeds}: there are {len(seeds)} seeds.", "Name fewer.")
    return seeds[: args.seeds]


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
    from harness.bench.limits import count_missed, outcome_of
    from harness.report.kit import format_statements

    content, outcome = {"rows": [row.as_dict() for row in rows], **content}, outcome_of(rows)
    if content.get("left_out") and outcome is not Outcome.REGRESSED:
        outcome = Outcome.INCOMPLETE
    table = format_statements(rows, reference=reference) if rows else []
    return print_result(args, content, *table, *lines, count_missed(rows), outcome=outcome)


def _bench_physics_truth(args: argparse.Namespace) -> Outcome:
    """Print the truth table of the physics and write its page."""
    from harness.bench.physics.error_statistics import LIMIT_M, MERGE_S, SEGMENT_S, compare_error_models
    from harness.bench.physics.truth import SEEDS, truth_rows
    from harness.report.physics.error_comparison import ErrorModelComparison
    from harness.report.physics.page import write_physics_page

    seeds, out = _first_seeds(args, SEEDS), folder_of(args, "physics")
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
    from harness.experiment.workers import process_executor

    seeds, out = _first_seeds(args, SEEDS), folder_of(args, LAB)
    with long_work(out, "captures") as progress, process_executor(args.jobs or 1) as executor:
        rows = lab_truth_rows(seeds, out, executor, progress)
    return _print_statements(args, rows, {"seeds": len(seeds), "captures": str(out / "captures")})


def _bench_accuracy(args: argparse.Namespace) -> Outcome:
    from harness.bench.accuracy.clip_errors import (
        DEFAULT_BASELINE,
        SETUP_BASELINES,
        StoredErrors,
        read_errors,
        write_errors,
    )
    from harness.bench.accuracy.conditions import DEFAULT_METHOD, SEEDS
    from harness.bench.accuracy.measurement import TABLES, clean_commit, measure_accuracy
    from harness.bench.accuracy.text import format_report, report_content
    from harness.core.files import require_writable

    if args.quick and (args.save or args.seeds or args.only):
        advice = "Leave out --save, --seeds and --only, or leave out --quick."
        raise BadInput("--quick has one seed and few clips, and no set-ups.", advice)
    seeds = _first_seeds(args, SEEDS)
    if args.save:
        require_writable(args.save, "errors by clip", force=args.force)
    commit = clean_commit() if args.save else ""
    stored, method = read_errors(args.baseline or DEFAULT_BASELINE), args.method or DEFAULT_METHOD
    tables = (args.only,) if args.only else TABLES
    references = [] if args.quick or args.only == "presets" else list(map(read_errors, SETUP_BASELINES))
    with _cells(args, ACCURACY) as options:
        report = measure_accuracy(
            method, stored, references=references, tables=tables, seeds=seeds, quick=bool(args.quick), **options
        )
    if args.save and not report.failures:
        write_errors(args.save, StoredErrors(method, commit, seeds, report.by_method[method]))
    return print_result(args, report_content(report), format_report(report), outcome=report.outcome)


def _bench_ranking(args: argparse.Namespace) -> Outcome:
    from harness.bench.ranking.measurement import measure_rankings, plan_rankings
    from harness.bench.ranking.text import format_rankings, rankings_content

    with _cells(args, RANKING) as options:
        report = measure_rankings(plan_rankings(quick=bool(args.quick)), **options)
    return print_result(args, rankings_content(report), format_rankings(report), outcome=report.outcome)


@contextmanager
def _cells(args: argparse.Namespace, name: str) -> Iterator[dict[str, Any]]:
    """Options with which a benchmark runs the cells of scenarios in its folder."""
    from harness.experiment.workers import process_executor

    jobs, out = args.jobs or 1, folder_of(args, name)
    with long_work(out, "cells") as bar, process_executor(jobs) as executor:
        yield {
            "out": out,
            "folder": args.mocap,
            "executor": executor,
            "workers": jobs,
            "command": this_command(),
            "progress": bar,
        }
