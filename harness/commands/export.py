"""The verb `export`: write the motion of a run for other programs."""

import argparse
from pathlib import Path

from harness.commands.flags import Verbs, add_verb
from harness.commands.output import print_result
from harness.core.options import split_outside_brackets
from harness.core.progress import ProgressBar
from harness.errors import BadInput, Outcome

_FORMATS = ("bvh", "trc", "mot", "sto", "csv", "tum", "glb")
"""`mocap.write.export.FORMATS`, which help shows without importing numpy."""


def add_export(verbs: Verbs) -> None:
    verb = add_verb(
        verbs, "export", "write the true and estimated motion of a run for other programs", run_export, "out", "force"
    )
    verb.add_argument("run", type=Path, help="folder written by `harness run`")
    verb.add_argument("--format", required=True, choices=_FORMATS, help="format of the files")
    text = "only these {}: names or patterns such as {}; may be repeated (default: all)"
    verb.add_argument("--clip", action="append", default=[], metavar="A,B", help=text.format("clips", "walking_*"))
    verb.add_argument("--method", action="append", default=[], metavar="A,B", help=text.format("methods", "ik*"))


def run_export(args: argparse.Namespace) -> Outcome:
    from harness.experiment import export_run

    folder = args.out or args.run / "export" / args.format
    clips, methods = _entries("clip", args.clip), _entries("method", args.method)
    with ProgressBar("cells") as bar:
        files = export_run(
            args.run, args.format, folder, clips=clips, methods=methods, force=args.force, progress=bar.count
        )
    following = ["view", files[0]] if args.format == "bvh" else []
    return print_result(
        args, {"files": [str(f) for f in files]}, f"{len(files)} files in {folder}", following=following
    )


def _entries(flag: str, texts: list[str]) -> list[str]:
    """The entries of lists that are separated by commas outside brackets; BadInput for an empty entry."""
    entries = [entry for text in texts for entry in split_outside_brackets(text, ",")]
    if not all(entries):
        raise BadInput(f"--{flag} {','.join(texts)!r} names no {flag}.", "Separate names by commas: A,B.")
    return entries
