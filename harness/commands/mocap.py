"""The verbs `mocap` and `inspect`: list or download real motion, and describe a file of motion or of emitters."""

import argparse
import sys
from pathlib import Path

from harness.commands.flags import Verbs, add_verb, refuse_flags, repeat_flags
from harness.commands.output import print_result
from harness.core.progress import ProgressBar
from harness.errors import BadInput, Outcome

CONSTELLATION_SUFFIX = ".mcf"
_OF_CONSTELLATIONS = ("clip", "stations", "out", "force")


def add_mocap(verbs: Verbs) -> None:
    verb = verbs.add_parser("mocap", help="list or download real motion", description="List or download real motion.")
    inner = verb.add_subparsers(title="actions", metavar="ACTION", required=True)
    add_verb(inner, "list", "list the clips of a library", run_mocap_list, "mocap")
    fetch = add_verb(inner, "fetch", "download clips of CMU's motion capture database", run_mocap_fetch)
    fetch.add_argument("database", choices=["cmu"], help="the database")
    fetch.add_argument("--subjects", required=True, metavar="13,14", help="CMU's subject numbers")
    fetch.add_argument("--out", type=Path, default=Path("mocap"), metavar="DIR", help="folder to write (default mocap)")
    fetch.add_argument("--url", help="address of a mirror with the same layout")


def run_mocap_list(args: argparse.Namespace) -> Outcome:
    from harness.mocap.library import MotionLibrary, ignored_paths_note
    from harness.mocap.sources import find_library_folders

    library = MotionLibrary(find_library_folders(args.mocap))
    entries = library.entries()
    for note in ignored_paths_note(library.ignored_paths):
        print(note, file=sys.stderr)
    if not entries:
        raise BadInput(
            "The library holds no clips.", "It may hold .amc files with their .asf, .bvh, .mvnx, .npz and .c3d files."
        )
    shown = next((entry.name for entry in entries if entry.format != "c3d"), None)  # a C3D file has markers only
    following = [] if shown is None else ["view", shown, *repeat_flags(args, "mocap")]
    content = {"clips": [entry.as_dict() for entry in entries]}
    return print_result(args, content, *(entry.line() for entry in entries), following=following)


def run_mocap_fetch(args: argparse.Namespace) -> Outcome:
    from harness.mocap.fetch import fetch_cmu

    subjects = [s.strip() for s in args.subjects.split(",") if s.strip()]
    where = {"base_url": args.url} if args.url else {}
    with ProgressBar("files") as progress:
        files = fetch_cmu(subjects, args.out, progress=progress, **where)
    text, following = f"{len(files)} files in {args.out}", ["mocap", "list", "--mocap", args.out]
    return print_result(args, {"files": [str(f) for f in files]}, text, following=following)


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
    emitters.add_argument("--out", type=Path, metavar="PAGE", help=text)
    emitters.add_argument("--force", action="store_true", default=None, help="overwrite a page that --out names")


def run_inspect(args: argparse.Namespace) -> Outcome:
    if args.file.suffix.lower() == CONSTELLATION_SUFFIX:
        from harness.commands.inspect_constellation import inspect_constellation

        return inspect_constellation(args)
    refuse_flags(args, _OF_CONSTELLATIONS, f"with {args.file.name}", "It is for an MCF file of emitters.")
    from harness.mocap.file_inspection import inspect_file as inspect
    from harness.mocap.sources import folders_of_environment

    library = args.mocap or folders_of_environment() or None
    found = inspect(args.file, rate_hz=args.rate, unit=args.unit, library=library)
    # a C3D file has markers only, and `view` takes no unit of length
    unseen = args.file.suffix.lower() == ".c3d" or args.unit is not None
    following = [] if unseen else ["view", args.file, *repeat_flags(args, "rate")]
    return print_result(args, found.as_dict(), *found.lines(), following=following)
