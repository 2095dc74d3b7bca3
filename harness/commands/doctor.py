"""The verb `doctor`: check this installation."""

import argparse

from harness.commands.flags import Verbs, add_verb
from harness.commands.output import print_result
from harness.core.cache_folder import remove_cache
from harness.core.progress import show_steps
from harness.errors import Outcome


def add_doctor(verbs: Verbs) -> None:
    verb = add_verb(
        verbs,
        "doctor",
        "check this installation: compiler, scores, streams, results, optional parts, the library of real motion",
        run_doctor,
        "mocap",
    )
    text = "remove the machine code that numba has compiled for the harness, and do nothing else"
    verb.add_argument("--clean", action="store_true", help=text)


def run_doctor(args: argparse.Namespace) -> Outcome:
    if args.clean:
        size_bytes = remove_cache()
        return print_result(args, {"removed_bytes": size_bytes}, f"removed {size_bytes / 1e6:.1f} MB of machine code")
    from harness.testing.doctor import check_installation

    with show_steps("checks"):
        checks = check_installation(args.mocap)
    lines = [f"{'ok  ' if check.ok else 'FAIL'}  {check.name}: {check.detail}" for check in checks]
    outcome = Outcome.PASS if all(check.ok for check in checks) else Outcome.REGRESSED
    return print_result(
        args, {"checks": [check._asdict() for check in checks]}, *lines, outcome=outcome, following=["demo"]
    )
