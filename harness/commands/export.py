"""The verb `export`: write the motion of a run for other programs."""

import argparse
from pathlib import Path

from harness.commands.common import Verbs, add_verb, print_result
from harness.errors import Outcome


def add_export(verbs: Verbs) -> None:
    verb = add_verb(
        verbs, "export", "write the true and estimated motion of a run for other programs", run_export, "out"
    )
    verb.add_argument("run", type=Path, help="folder written by `harness run`")
    verb.add_argument("--format", required=True, choices=["bvh", "trc", "csv", "tum"], help="format of the files")
    verb.add_argument("--force", action="store_true", help="overwrite files that exist")


def run_export(args: argparse.Namespace) -> Outcome:
    from harness.mocap.write.export import export
    from harness.results.storage import read_cells

    folder = args.out or args.run / "export" / args.format
    files = export(read_cells(args.run), args.format, folder, force=args.force)
    return print_result(args, {"files": [str(f) for f in files]}, f"{len(files)} files in {folder}")
