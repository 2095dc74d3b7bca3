"""The verb `plot`: draw a figure for a paper from a run or a placement study."""

import argparse
import textwrap
from pathlib import Path

from harness.commands.flags import Verbs, add_verb, output_file, positive_int, repeat_flags, split_list
from harness.commands.output import print_result
from harness.errors import Outcome

_CAPTION_WIDTH = 100


def add_plot(verbs: Verbs) -> None:
    verb = add_verb(verbs, "plot", "draw a figure for a paper from a run or a placement study", run_plot)
    verb.add_argument("run", type=Path, help="folder written by `harness run` or `placement`")
    text = (
        "what to draw: ranking, time, joints, cdf (of a run) or placement (default: ranking, or placement of a study)"
    )
    verb.add_argument("--kind", default="", metavar="KIND", help=text)
    text = "width in print [mm]: 85, a column, or 170, a page (default 85, of time and placement 170)"
    verb.add_argument("--width", type=positive_int, metavar="MM", help=text)
    verb.add_argument("--metric", metavar="NAME", help="metric to draw (default joint_angle_mean_deg)")
    verb.add_argument("--methods", metavar="A,B", help="methods to show (default: all); only these are ranked")
    text = "condition to show, such as noise=clean (default: ranking shows all, others the last of the run)"
    verb.add_argument("--condition", default="", metavar="NAME", help=text)
    text = "clip to show (default: of time the one with the largest error, of others all)"
    verb.add_argument("--clip", default="", metavar="NAME", help=text)
    text = "method that time and joints show next to the leader (default: ik)"
    verb.add_argument("--control", default="", metavar="METHOD", help=text)
    text = "file to write with the suffix .pdf, .svg or .png (default: figures/NAME.pdf in the folder of the run)"
    verb.add_argument("--out", type=output_file, metavar="FILE", help=text)
    verb.add_argument("--force", action="store_true", help="replace a file that exists")


def run_plot(args: argparse.Namespace) -> Outcome:
    from harness.report.figures.print_figure import FigureSelection
    from harness.report.figures.writer import write_figure

    selection = FigureSelection(
        metric=args.metric or FigureSelection.metric,
        methods=tuple(split_list(args.methods)),
        condition=args.condition,
        clip=args.clip,
        control=args.control,
    )
    figure = write_figure(args.run, args.kind, selection, width_mm=args.width, out=args.out, force=args.force)
    content = {**vars(figure), "path": str(figure.path)}
    following: list[object] = []
    if figure.kind != "placement":
        metrics = ["--metrics", args.metric] if args.metric else []
        flags = repeat_flags(args, "methods", "condition")
        following = ["table", args.run, "--format", "latex", *metrics, *flags]
    size = f"{figure.width_mm:.0f} x {figure.height_mm:.0f} mm"
    caption = textwrap.fill(f"caption: {figure.caption}", _CAPTION_WIDTH)
    return print_result(args, content, f"figure: {figure.path} ({size})", caption, following=following)
