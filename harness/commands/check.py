"""The verb `check`: test methods against the contract."""

import argparse
import sys
from contextlib import redirect_stdout
from typing import TYPE_CHECKING

from harness.commands.flags import Verbs, add_verb
from harness.commands.output import print_result
from harness.core.progress import ProgressBar
from harness.errors import Outcome

if TYPE_CHECKING:
    from harness.testing.method_checks import RuleResult


def add_check(verbs: Verbs) -> None:
    verb = add_verb(
        verbs, "check", "test methods against the contract: causality, determinism, lost stations, recovery", run_check
    )
    text = "a name as in scenarios, or my_module:MyMethod (default: all registered methods)"
    verb.add_argument("methods", nargs="*", metavar="METHOD", help=text)


def run_check(args: argparse.Namespace) -> Outcome:
    from harness.reconstruct import is_built_in, list_methods, make_method
    from harness.testing.check_process import check_rules_apart
    from harness.testing.method_checks import check_rules
    from harness.testing.rules import RULES

    found: dict[str, list[RuleResult]] = {}
    with ProgressBar("rules") as bar, redirect_stdout(sys.stderr):  # a method may print; stdout is for data
        names = args.methods or sorted(list_methods())
        inside = {name: make_method(name) for name in names if is_built_in(name)}
        for name in names:
            found[name] = []
            for finding in check_rules(inside[name]) if name in inside else check_rules_apart(name):
                found[name].append(finding)
                bar(f"{name}: {finding.rule}", sum(map(len, found.values())), len(names) * len(RULES))
    lines = []
    for name, findings in found.items():
        lines += [name, *(f"  {'ok  ' if f.ok else 'FAIL'}  {f.rule}: {f.seen}" for f in findings)]
    broken = any(not finding.ok for findings in found.values() for finding in findings)
    content = {"methods": {name: [finding._asdict() for finding in findings] for name, findings in found.items()}}
    own = [name for name in names if ":" in name]
    following = (
        ["run", "demo", "--methods", ",".join(["ik", *own]), "--out", "results/mine"] if own else ["run", "gate"]
    )
    if broken:
        return print_result(args, content, *lines, outcome=Outcome.REGRESSED)
    return print_result(args, content, *lines, following=following)
