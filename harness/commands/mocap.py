"""Verbs about recorded motion: look into a file, list a library, download one."""

import argparse
import os
import sys
from pathlib import Path

from harness.commands.common import Verbs, add_verb, print_result
from harness.core.progress import ProgressBar
from harness.errors import BadInput, Outcome


def add_inspect(verbs: Verbs) -> None:
    verb = add_verb(verbs, "inspect", "say what a motion file is, and what is wrong with it", run_inspect, "mocap")
    verb.add_argument("file", type=Path)
    verb.add_argument("--rate", type=float, metavar="HZ", help="frames per second, for files that do not record it")
    verb.add_argument("--unit", metavar="M", type=float, help="metres per unit of length, where files do not record it")


def run_inspect(args: argparse.Namespace) -> Outcome:
    from harness.mocap.file_inspection import inspect_file as inspect
    from harness.mocap.sources import MOCAP_VARIABLE

    library = args.mocap or (Path(os.environ[MOCAP_VARIABLE]) if os.environ.get(MOCAP_VARIABLE) else None)
    found = inspect(args.file, rate_hz=args.rate, unit=args.unit, library=library)
    return print_result(args, found.as_dict(), *found.lines())


def add_mocap(verbs: Verbs) -> None:
    verb = verbs.add_parser("mocap", help="list or download real motion", description="Libraries of real motion.")
    inner = verb.add_subparsers(title="what to do", metavar="WHAT", required=True)
    add_verb(inner, "list", "name the clips of a library", run_mocap_list, "mocap")
    fetch = add_verb(inner, "fetch", "download clips of CMU's motion capture database", run_mocap_fetch)
    fetch.add_argument("database", choices=["cmu"])
    fetch.add_argument("--subjects", required=True, metavar="13,14", help="CMU's subject numbers")
    fetch.add_argument("--out", type=Path, default=Path("mocap"), metavar="DIR", help="where to (default mocap/)")
    fetch.add_argument("--url", help="another address of the same layout (a mirror)")


def run_mocap_list(args: argparse.Namespace) -> Outcome:
    from harness.mocap.library import MotionLibrary, ignored_paths_note
    from harness.mocap.sources import find_library_folders

    library = MotionLibrary(find_library_folders(args.mocap))
    entries = library.entries()
    for note in ignored_paths_note(library.ignored_paths):
        print(note, file=sys.stderr)
    if not entries:
        raise BadInput("There are no clips in it.", "Looked for .amc with .asf, .bvh, .npz and .c3d files.")
    return print_result(args, {"clips": [entry.as_dict() for entry in entries]}, *(entry.line() for entry in entries))


def run_mocap_fetch(args: argparse.Namespace) -> Outcome:
    from harness.mocap.fetch import fetch_cmu

    subjects = [s.strip() for s in args.subjects.split(",") if s.strip()]
    where = {"base_url": args.url} if args.url else {}
    with ProgressBar("files") as progress:
        files = fetch_cmu(subjects, args.out, progress=progress, **where)
    text = f"{len(files)} files in {args.out}; use them with --mocap {args.out}"
    return print_result(args, {"files": [str(f) for f in files]}, text)
