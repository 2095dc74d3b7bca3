"""The flags for processes of methods, which `run` and `sweep` share."""

import argparse
from typing import TYPE_CHECKING

from harness.commands.common import positive_float

if TYPE_CHECKING:
    from harness.experiment.isolation import Isolation


def add_isolation_flags(verb: argparse.ArgumentParser) -> None:
    """Add `--isolate`, `--time-limit` and `--memory-limit`."""
    text = "run every method in a process of its own; methods from outside the package always have one"
    verb.add_argument("--isolate", action="store_true", help=text)
    text = "longest time of such a method for its training, and for one take (default 600)"
    verb.add_argument("--time-limit", type=positive_float, metavar="S", help=text)
    text = "largest memory of such a method (default 0.8 of the machine's, divided by --jobs)"
    verb.add_argument("--memory-limit", type=positive_float, metavar="GB", help=text)


def read_isolation(args: argparse.Namespace) -> "Isolation":
    """The isolation that those flags ask for."""
    from harness.experiment.isolation import DEFAULT_TIME_LIMIT_S, Isolation

    return Isolation(args.isolate, args.time_limit or DEFAULT_TIME_LIMIT_S, args.memory_limit)
