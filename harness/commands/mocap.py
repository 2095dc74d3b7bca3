"""The verb `mocap`: list a library of real motion, or download one."""

import argparse

from harness.commands.flags import Verbs, add_verb, output_folder, repeat_flags
from harness.commands.output import print_result, print_status
from harness.core.progress import ProgressBar
from harness.errors import BadInput, Outcome


def add_mocap(verbs: Verbs) -> None:
    verb = verbs.add_parser("mocap", help="list or download real motion", description="List or download real motion.")
    inner = verb.add_subparsers(title="actions", metavar="ACTION", required=True)
    add_verb(inner, "list", "list the clips of a library", run_mocap_list, "mocap")
    fetch = add_verb(inner, "fetch", "download clips of CMU's motion capture database", run_mocap_fetch)
    fetch.add_argument("database", choices=["cmu"], help="the database")
    fetch.add_argument("--subjects", required=True, metavar="13,14", help="CMU's subject numbers")
    text = "folder to write (default mocap)"
    fetch.add_argument("--out", type=output_folder, default="mocap", metavar="DIR", help=text)
    fetch.add_argument("--url", help="address of a mirror with the same layout")


def run_mocap_list(args: argparse.Namespace) -> Outcome:
    from harness.mocap import MotionLibrary, find_library_folders, ignored_paths_note

    library = MotionLibrary(find_library_folders(args.mocap))
    entries = library.entries()
    for note in ignored_paths_note(library.ignored_paths):
        print_status(note)
    if not entries:
        raise BadInput(
            "The library holds no clips.", "It may hold .amc files with their .asf, .bvh, .mvnx, .npz and .c3d files."
        )
    shown = next((entry.name for entry in entries if entry.format != "c3d"), None)  # a C3D file has markers only
    following = [] if shown is None else ["view", shown, *repeat_flags(args, "mocap")]
    content = {"clips": [entry.as_dict() for entry in entries]}
    return print_result(args, content, *(entry.line() for entry in entries), following=following)


def run_mocap_fetch(args: argparse.Namespace) -> Outcome:
    from harness.mocap import fetch_cmu

    subjects = [s.strip() for s in args.subjects.split(",") if s.strip()]
    where = {"base_url": args.url} if args.url else {}
    with ProgressBar("files") as progress:
        files = fetch_cmu(subjects, args.out, progress=progress, **where)
    text, following = f"{len(files)} files in {args.out}", ["mocap", "list", "--mocap", args.out]
    return print_result(args, {"files": [str(f) for f in files]}, text, following=following)
