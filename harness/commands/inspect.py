"""The verb `inspect`: describe a motion file and what is wrong with it, or the coverage of a constellation."""

import argparse
from pathlib import Path

from harness.commands.flags import Verbs, add_verb, output_file, refuse_flags, repeat_flags
from harness.commands.output import print_result
from harness.errors import Outcome

CONSTELLATION_SUFFIX = ".mcf"
_OF_CONSTELLATIONS = ("clip", "stations", "out", "force")


def add_inspect(verbs: Verbs) -> None:
    verb = add_verb(
        verbs,
        "inspect",
        "describe a motion file and what is wrong with it, or the coverage of a constellation of emitters",
        run_inspect,
        "mocap",
    )
    verb.add_argument("file", type=Path, help="an AMC, BVH, MVNX, C3D or AMASS npz file, or an MCF file of emitters")
    verb.add_argument("--rate", type=float, metavar="HZ", help="frames per second of a file that records no rate")
    text = "metres per unit of length of a file that records no unit"
    verb.add_argument("--unit", metavar="M", type=float, help=text)
    emitters = verb.add_argument_group("of an MCF file")
    text = "performer below the emitters: name of a clip, or a motion file; its stations are looked at"
    emitters.add_argument("--clip", metavar="CLIP", help=text)
    emitters.add_argument(
        "--stations", metavar="SET", help="set of stations that the performer wears (default liu2011)"
    )
    text = "page to write (default results/coverage/NAME.html, which is replaced)"
    emitters.add_argument("--out", type=output_file, metavar="PAGE", help=text)
    emitters.add_argument("--force", action="store_true", default=None, help="overwrite a page that --out names")


def run_inspect(args: argparse.Namespace) -> Outcome:
    if args.file.suffix.lower() == CONSTELLATION_SUFFIX:
        from harness.commands.inspect_constellation import inspect_constellation

        return inspect_constellation(args)
    refuse_flags(args, _OF_CONSTELLATIONS, f"with {args.file.name}", "It is for an MCF file of emitters.")
    from harness.mocap import folders_of_environment
    from harness.mocap import inspect_file as inspect

    library = args.mocap or folders_of_environment() or None
    found = inspect(args.file, rate_hz=args.rate, unit=args.unit, library=library)
    # a C3D file has markers only, and `view` takes no unit of length
    unseen = args.file.suffix.lower() == ".c3d" or args.unit is not None
    following = [] if unseen else ["view", args.file, *repeat_flags(args, "rate")]
    return print_result(args, found.as_dict(), *found.lines(), following=following)
