"""The verb `list`: name the methods, scenarios, places, takes and metrics."""

import argparse

from harness.commands.flags import Verbs, add_verb
from harness.commands.output import print_result
from harness.errors import Outcome, UnknownName


def add_list(verbs: Verbs) -> None:
    text = (
        "list the methods, scenarios, studies, places on the body, synthetic takes, noise presets, figures, hinges "
        "and metrics"
    )
    verb = add_verb(verbs, "list", text, run_list)
    verb.add_argument("kind", nargs="?", help="list one kind alone, such as methods, places, hinges or metrics")
    verb.add_argument("--all", action="store_true", help="also scenarios that only choose or check constants")


def run_list(args: argparse.Namespace) -> Outcome:
    from harness.commands.catalogue import build_catalogue

    content = build_catalogue(every=args.all)
    following = ["demo"]
    if args.kind is not None:
        titles = {title.split()[0]: title for title in content}  # "motion" for "motion of the built-in performer"
        if args.kind not in titles:
            raise UnknownName("kind of name", args.kind, titles)
        content = {titles[args.kind]: content[titles[args.kind]]}
        following = _FOLLOWING.get(args.kind, following)
    lines = []
    for title, entries in content.items():
        width = max(len(name) for name in entries)
        lines += [f"{title}:", *(f"  {name:<{width}}  {text}" for name, text in entries.items())]
    return print_result(args, content, *lines, following=following)


_FOLLOWING = {"places": ["placement", "--stations", "3", "--places", "head,torso,pelvis,hand,thigh"]}
"""Kind -> the words of the command that uses its names."""
