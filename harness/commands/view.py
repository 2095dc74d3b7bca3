"""The verb `view`: show motion, runs and recordings in 3-D in the browser, or save them as a movie or a page."""

import argparse
import sys
from collections.abc import Mapping
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.commands.flags import (
    Verbs,
    add_verb,
    output_file,
    parse_methods,
    positive_float,
    refuse_flags,
)
from harness.commands.output import print_result, print_status
from harness.commands.pose_flags import OWN_POSE_FLAGS, add_pose_flags, pose_options
from harness.core.progress import ProgressBar
from harness.errors import BadInput, Outcome, was_interrupted

if TYPE_CHECKING:
    from harness.view import ViewedMotion

_MOST_SAVED_S = 60.0
"""Longest movie that the page may ask for [s]; `--save` has no such limit."""


def add_view(verbs: Verbs) -> None:
    text = "show a clip, a run or a recording in 3-D in the browser; save movies and pages"
    verb = add_verb(verbs, "view", text, run_view, "seed", "mocap", "force")
    text = "name of a clip, motion file (AMC, BVH, MVNX, AMASS npz), folder of a run, recording, or file of poses"
    verb.add_argument("what", metavar="CLIP|RUN|RECORDING", help=text)
    text = "methods to show, in this order (default: all of a run, none of a recording)"
    verb.add_argument("--methods", metavar="A,B", help=text)
    verb.add_argument("--clip", metavar="NAME", help="clip of a run to begin with, or clip that was recorded")
    text = "scenario that was played, if the recording does not name it"
    verb.add_argument("--scenario", metavar="NAME", help=text)
    verb.add_argument(
        "--rate", type=positive_float, metavar="HZ", help="frames per second of an AMC file or of matrices"
    )
    text = "write a movie of the clip, with up to three methods side by side, instead of opening a browser"
    verb.add_argument("--save", type=output_file, metavar="FILE.mp4|FILE.gif", help=text)
    verb.add_argument("--from", type=float, dest="start", default=0.0, metavar="S", help="start of the movie")
    verb.add_argument("--to", type=float, dest="end", default=float("inf"), metavar="S", help="end of the movie")
    verb.add_argument("--colour-by-error", action="store_true", help="colour bodies in the movie by their error")
    text = "write one page that holds all of it, instead of opening a browser"
    verb.add_argument("--out", type=output_file, metavar="FILE.html", help=text)
    verb.add_argument("--no-browser", action="store_true", help="print the address alone")
    add_pose_flags(verb, shared=("rate",))


def run_view(args: argparse.Namespace) -> Outcome:
    from harness.core.files import require_writable, write_output
    from harness.view import check_movie, write_page

    if args.save is not None:
        check_movie(args.save)
    for path in filter(None, (args.save, args.out)):
        require_writable(path, "a movie or a page", force=args.force)
    motion = _open(args)
    if args.save is None and args.out is None:
        return _serve(args, motion)
    lines, content = [], {}
    if args.save is not None:
        args.save.parent.mkdir(parents=True, exist_ok=True)
        frames = _save_movie(args, motion)
        lines.append(f"{args.save}: {frames} frames, {args.save.stat().st_size / 1e6:.1f} MB")
        content["movie"] = str(args.save)
    if args.out is not None:
        with ProgressBar("clips") as bar:
            write_output(args.out, write_page(motion, bar), "a page", force=True)
        lines.append(f"{args.out}: {args.out.stat().st_size / 1e6:.1f} MB")
        content["page"] = str(args.out)
    return print_result(args, content, *lines)


def _open(args: argparse.Namespace) -> "ViewedMotion":
    from harness.commands.viewed_motion import open_motion, view_poses
    from harness.study.trust.pose_source import holds_poses, read_poses

    methods = None if args.methods is None else parse_methods(args.methods)
    if holds_poses(Path(args.what)):
        advice = "Poses of another program name no performer, mounts or motion: leave it out."
        refuse_flags(args, ("methods", "scenario", "clip", "seed", "mocap"), f"with the poses of {args.what}", advice)
        return view_poses(read_poses([Path(args.what)], pose_options(args)))
    refuse_flags(args, OWN_POSE_FLAGS, f"with {args.what}", "It is for poses of another program: leave it out.")
    of_run = Path(args.what).is_dir()
    playback = {"scenario": args.scenario, "clip": None if of_run else args.clip, "seed": args.seed}
    options = {
        "methods": methods,
        "mocap": args.mocap,
        "rate_hz": args.rate,
        "playback": playback,
    }
    with ProgressBar("steps") as bar, redirect_stdout(sys.stderr):  # a method may print; stdout is for data
        motion = open_motion(args.what, **options, progress=bar)
    return motion.beginning_with(args.clip) if of_run and args.clip is not None else motion


def _save_movie(args: argparse.Namespace, motion: "ViewedMotion") -> int:
    from harness.view import MOST_METHODS, MoviePart, write_movie

    clip = motion.clip(0)
    names = [track.name for track in clip.estimates]
    shown = names[: MOST_METHODS if args.methods else 1]
    print_status(f"drawing {clip.name}{' with ' if shown else ''}{', '.join(shown)}")
    part = MoviePart(shown, args.start, args.end, args.colour_by_error)
    with ProgressBar("frames") as bar:
        return write_movie(motion.skeleton, clip, part, args.save, bar)


def _serve(args: argparse.Namespace, motion: "ViewedMotion") -> Outcome:
    """Serve the viewer until Ctrl-C, which is its normal end."""
    import secrets
    import threading
    import webbrowser

    from harness.view import ViewerContent, ViewServer

    token = secrets.token_urlsafe(24)
    content = ViewerContent(motion, token)
    motion.clip(0)  # a damaged clip is an error now, and not in the browser
    commands = {"save": lambda wanted: _save_for_page(content, wanted)}
    if motion.note:
        print_status(motion.note)
    with ViewServer(content.find, commands, token=token) as server:
        print_status(f"{motion.title}: {server.url}  (Ctrl-C ends it)")
        if not args.no_browser and not webbrowser.open(server.url):
            print_status("No browser was found: open the address in one.")
        try:
            threading.Event().wait()
        except (KeyboardInterrupt, Exception) as error:
            if not was_interrupted(error):
                raise
    return print_result(args, {"url": server.url, "clips": list(motion.names)}, f"{motion.title}: closed")


def _save_for_page(content: Any, wanted: Mapping[str, Any]) -> Mapping[str, Any]:
    """Make the movie that the page asks for, and serve it; BadInput for a request that makes no sense."""
    from tempfile import TemporaryDirectory

    from harness.report.kit import to_file_name
    from harness.view import MOVIE_SUFFIXES, MoviePart, Resource, write_movie

    try:
        number, methods = int(wanted["clip"]), [str(name) for name in wanted["methods"]]
        start_s, end_s = float(wanted["start_s"]), float(wanted["end_s"])
        suffix, errors = f".{wanted['format']}", bool(wanted["errors"])
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise BadInput("The request names no clip, methods, start, end and format.", "Load the page again.") from error
    if not 0 <= number < len(content.motion.names) or suffix not in MOVIE_SUFFIXES:
        raise BadInput("The request names no clip or format of this page.", "Load the page again.")
    if not end_s - start_s <= _MOST_SAVED_S:
        raise BadInput(f"A movie of {end_s - start_s:g} s.", f"The page saves up to {_MOST_SAVED_S:g} s; --save more.")
    clip = content.motion.clip(number)
    name = f"{to_file_name(clip.name)}{suffix}"
    with TemporaryDirectory(prefix="harness-view-") as folder:
        path = Path(folder) / name
        write_movie(content.motion.skeleton, clip, MoviePart(methods, start_s, end_s, errors), path)
        kind = "video/mp4" if suffix == ".mp4" else "image/gif"
        content.add(f"/saved/{name}", Resource(kind, path.read_bytes(), name))
    return {"path": f"/saved/{name}", "name": name}
