"""The verb `list`: name the methods, scenarios, takes and metrics."""

import argparse

from harness.commands.common import Verbs, add_verb, print_result
from harness.errors import Outcome


def add_list(verbs: Verbs) -> None:
    add_verb(
        verbs,
        "list",
        "list the methods, scenarios, studies, synthetic takes, noise presets, figures and metrics",
        run_list,
    )


def run_list(args: argparse.Namespace) -> Outcome:
    from harness.commands.catalogue import build_catalogue

    content = build_catalogue()
    lines = []
    for title, entries in content.items():
        width = max(len(name) for name in entries)
        lines += [f"{title}:", *(f"  {name:<{width}}  {text}" for name, text in entries.items())]
    return print_result(args, content, *lines, following=["demo"])
