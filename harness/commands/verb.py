"""What the verbs of the command line share: their flags, and how they answer."""

import argparse
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from harness.errors import Outcome

Verbs = Any  # argparse's subparsers object has no public type
Action = Callable[[argparse.Namespace], Outcome]


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


def say(args: argparse.Namespace, content: Mapping[str, Any], *lines: str, outcome: Outcome = Outcome.PASS) -> Outcome:
    """Print the lines, or with --json the content and the outcome's word; returns the outcome."""
    print(json.dumps({**content, "outcome": outcome.word}) if args.json else "\n".join(lines))
    return outcome
