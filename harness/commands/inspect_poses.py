"""`harness inspect` of poses: what a file is, each conclusion with its reason, and how its bodies were sampled."""

import argparse
from collections.abc import Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from harness.commands.flags import repeat_flags
from harness.commands.output import print_result
from harness.commands.pose_flags import POSE_FLAGS, pose_options
from harness.core.number_format import count_noun, format_fixed, format_share
from harness.core.text_table import Table
from harness.errors import Outcome

if TYPE_CHECKING:
    from harness.stream import PoseLog
    from harness.stream.recording import PoseRecording

_HEAD = ("body", "poses", "rate [Hz]", "90 % of steps [ms]", "gaps", "longest gap [s]", "repeated", "extent [m]")


def inspect_poses(args: argparse.Namespace, paths: Sequence[Path]) -> Outcome:
    """Print what one file of poses is, or several on one clock."""
    from harness.stream import FEWEST_POSES, UNTIMED, measure_sampling
    from harness.study.trust.pose_source import read_poses

    found = read_poses(paths, pose_options(args, untimed=True))
    log, timed = found.log, found.log.clock != UNTIMED
    bodies = [measure_sampling(body) for body in log.bodies]
    lines = [_title(log, timed=timed), *map(str, log.findings), *_recording_lines(found)]
    rows = [
        [
            one.name,
            f"{one.poses:,}",
            format_fixed(one.rate_hz if timed else None, 2),
            f"{one.step_ms[0]:.1f} to {one.step_ms[1]:.1f}" if one.step_ms and timed else "-",
            str(one.gaps),
            format_fixed(one.longest_gap_s, 3) if timed else "-",
            format_share(one.repeated_share, 1),
            " x ".join(f"{side:.2f}" for side in one.extent_m),
        ]
        for one in bodies
    ]
    lines += ["", *Table(_HEAD, rows).lines()]
    content = {
        "source": log.source,
        "clock": log.clock,
        "start_unix_s": log.start_unix_s,
        "duration_s": log.duration_s if timed else None,
        "findings": [asdict(finding) for finding in log.findings],
        "bodies": [
            asdict(one) if timed else {"name": one.name, "poses": one.poses, "repeated_share": one.repeated_share}
            for one in bodies
        ],
        "marks": [{"at_s": at_s, "stretch": stretch} for at_s, stretch in found.marks],
        "damage": list(found.damage),
    }
    flags = repeat_flags(args, *POSE_FLAGS)
    following = ["characterize", *paths, *flags]
    if len(paths) > 1:
        few = min(one.poses for one in bodies) < FEWEST_POSES
        following = [] if few else ["validate", paths[0], "--truth", paths[1], *flags]
    elif max(one.poses for one in bodies) < FEWEST_POSES:
        following = ["view", *paths, *flags]
    if not timed:
        following = ["inspect", *paths, *flags, "--rate", "HZ"]
    return print_result(args, content, *lines, following=following)


def _title(log: "PoseLog", *, timed: bool) -> str:
    poses = sum(len(body.times_s) for body in log.bodies)
    bodies = "1 body" if len(log.bodies) == 1 else f"{len(log.bodies)} bodies"
    duration = f", {log.duration_s:.2f} s" if timed else ""
    clock = f", {log.clock}"
    if log.start_unix_s is not None:
        clock += f" from {datetime.fromtimestamp(log.start_unix_s, UTC):%Y-%m-%d %H:%M:%S} UTC"
    return f"{log.source}: {count_noun(poses, 'pose')} of {bodies}{duration}{clock}"


def _recording_lines(found: "PoseRecording") -> list[str]:
    """Lines about the marks, the plan and the damage of a recording."""
    marks = ", ".join(f"{stretch or 'end'} from {at_s:g} s" for at_s, stretch in found.marks)
    return [
        *([f"marks: {marks}"] if marks else []),
        *([f"plan: {found.plan[:12]}"] if found.plan else []),
        *(f"lost: {text}" for text in found.damage),
    ]
