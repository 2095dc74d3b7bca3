"""The verb `inspect`: describe a motion file and what is wrong with it."""

import argparse
from pathlib import Path

from harness.commands.common import Verbs, add_verb, print_result
from harness.errors import Outcome


def add_inspect(verbs: Verbs) -> None:
    verb = add_verb(
        verbs,
        "inspect",
        "describe a motion file: skeleton, rate, unit, and what is wrong with it",
        run_inspect,
        "mocap",
    )
    verb.add_argument("file", type=Path, help="an AMC, BVH, MVNX, C3D or AMASS npz file")
    verb.add_argument("--rate", type=float, metavar="HZ", help="frames per second of a file that records no rate")
    text = "metres per unit of length of a file that records no unit"
    verb.add_argument("--unit", metavar="M", type=float, help=text)


def run_inspect(args: argparse.Namespace) -> Outcome:
    from harness.mocap.file_inspection import inspect_file as inspect
    from harness.mocap.sources import folders_of_environment

    library = args.mocap or folders_of_environment() or None
    found = inspect(args.file, rate_hz=args.rate, unit=args.unit, library=library)
    following = [] if args.file.suffix.lower() == ".c3d" else ["view", args.file]  # a C3D file has markers only
    return print_result(args, found.as_dict(), *found.lines(), following=following)
