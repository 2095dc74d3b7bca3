"""Verbs about the harness itself and its methods: what there is, whether it works, how fast."""

import argparse
import sys
from contextlib import redirect_stdout
from typing import TYPE_CHECKING

from harness.commands.common import Verbs, add_verb, print_result
from harness.core.progress import ProgressBar
from harness.errors import Outcome

if TYPE_CHECKING:
    from harness.testing.method_checks import RuleResult


def add_list(verbs: Verbs) -> None:
    add_verb(verbs, "list", "name the methods, scenarios, built-in takes and metrics", run_list)


def run_list(args: argparse.Namespace) -> Outcome:
    from harness.commands.catalogue import build_catalogue

    content = build_catalogue()
    lines = []
    for title, entries in content.items():
        width = max(len(name) for name in entries)
        lines += [f"{title}:", *(f"  {name:<{width}}  {text}" for name, text in entries.items())]
    return print_result(args, content, *lines)


def add_check(verbs: Verbs) -> None:
    verb = add_verb(verbs, "check", "try methods for the contract: causality, lost stations, recovery", run_check)
    text = "names as in scenarios, or my_module:MyMethod (default: all that are registered)"
    verb.add_argument("methods", nargs="*", metavar="METHOD", help=text)


def run_check(args: argparse.Namespace) -> Outcome:
    from harness.reconstruct import registry
    from harness.testing.method_checks import check_rules
    from harness.testing.rules import RULES

    found: dict[str, list[RuleResult]] = {}
    with ProgressBar("rules") as bar, redirect_stdout(sys.stderr):  # what a method prints is talk
        methods = {name: registry.resolve(name) for name in args.methods or sorted(registry.methods())}
        for name, method in methods.items():
            found[name] = []
            for finding in check_rules(method):
                found[name].append(finding)
                bar(f"{name}: {finding.rule}", sum(map(len, found.values())), len(methods) * len(RULES))
    lines = []
    for name, findings in found.items():
        lines += [name, *(f"  {'ok  ' if f.ok else 'FAIL'}  {f.rule}: {f.seen}" for f in findings)]
    broken = any(not finding.ok for findings in found.values() for finding in findings)
    content = {"methods": {name: [finding.as_dict() for finding in findings] for name, findings in found.items()}}
    return print_result(args, content, *lines, outcome=Outcome.REGRESSED if broken else Outcome.PASS)


def add_bench(verbs: Verbs) -> None:
    verb = add_verb(verbs, "bench", "measure speed: ratios and medians of one run on this machine", run_bench, "seed")
    verb.add_argument("what", nargs="*", help="methods, ik, index, wire, stream, load, gate, startup (default: all)")
    verb.add_argument("--large", action="store_true", help="methods: a million frames too; wire: ten minutes a line")


def run_bench(args: argparse.Namespace) -> Outcome:
    from harness.bench.benchmarks import run_benchmarks
    from harness.bench.rows import format_rows

    with ProgressBar("benchmarks") as progress:
        seed = args.seed if args.seed is not None else 1
        rows, left_out = run_benchmarks(tuple(args.what), seed=seed, large=args.large, progress=progress)
    content = {"rows": [row.as_dict() for row in rows], "left_out": left_out}
    return print_result(
        args, content, format_rows(rows), *left_out, outcome=Outcome.INCOMPLETE if left_out else Outcome.PASS
    )


def add_doctor(verbs: Verbs) -> None:
    add_verb(verbs, "doctor", "check this installation: scores, methods, pictures, motion", run_doctor, "mocap")


def run_doctor(args: argparse.Namespace) -> Outcome:
    from harness.testing.doctor import check_installation

    checks = check_installation(args.mocap)
    lines = [f"{'ok  ' if check.ok else 'FAIL'}  {check.name}: {check.detail}" for check in checks]
    outcome = Outcome.PASS if all(check.ok for check in checks) else Outcome.REGRESSED
    return print_result(args, {"checks": [check.as_dict() for check in checks]}, *lines, outcome=outcome)
