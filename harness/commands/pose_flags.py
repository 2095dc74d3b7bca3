"""Flags of verbs that read poses of other programs."""

import argparse
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from harness.core.units import TIME_UNITS_S, parse_length_unit
from harness.errors import BadFile, BadInput

if TYPE_CHECKING:
    from harness.stream import PoseFileOptions

POSE_FLAGS = ("columns", "unit", "quaternion", "euler", "up", "time_unit", "rate")
"""Flags of `add_pose_flags`, as attributes of the parsed command line."""
OWN_POSE_FLAGS = tuple(name for name in POSE_FLAGS if name != "rate")
"""Those that other uses of a verb do not have."""
TRUTH_PREFIX = "truth-"
"""Prefix of the same flags for the reference."""


def add_pose_flags(verb: argparse.ArgumentParser, *, shared: Sequence[str] = (), prefix: str = "") -> None:
    """Add the flags by which a user overrides what a file of poses shows; `shared` ones the verb has already."""
    of = "of a reference with such poses" if prefix else "of poses of other programs (TUM, EuRoC, CSV, matrices)"
    poses = verb.add_argument_group(f"{of}, in place of the evidence")
    text = "names of the columns in their order, such as time,x,y,z,qx,qy,qz,qw; - for others"
    poses.add_argument(f"--{prefix}columns", metavar="A,B", help=text)
    poses.add_argument(f"--{prefix}quaternion", metavar="ORDER", help="order of a quaternion: xyzw or wxyz")
    text = "axes about which angles turn, as the body then stands: zyx is yaw, pitch, roll; unit: zyx:deg or zyx:rad"
    poses.add_argument(f"--{prefix}euler", metavar="AXES", help=text)
    text = f"axis that points up: x, y, z, -x, -y or -z (write --{prefix}up=-y)"
    poses.add_argument(f"--{prefix}up", metavar="AXIS", help=text)
    poses.add_argument(f"--{prefix}time-unit", metavar="U", help=f"unit of times: {', '.join(TIME_UNITS_S)}")
    if "unit" not in shared:
        text = "unit of length: mm, cm, m, in, ft, or metres per unit"
        poses.add_argument(f"--{prefix}unit", metavar="M", type=parse_length_unit, help=text)
    if "rate" not in shared:
        text = "samples per second of a file without times"
        poses.add_argument(f"--{prefix}rate", metavar="HZ", type=float, help=text)


def pose_options(args: argparse.Namespace, *, untimed: bool = False, prefix: str = "") -> "PoseFileOptions":
    """What the flags say; `untimed` reads files without times and rate all the same. Raises BadInput."""
    from harness.stream import PoseFileOptions

    given = {name: getattr(args, f"{prefix}{name}".replace("-", "_")) for name in POSE_FLAGS}
    names, unit_m, rate_hz = given.pop("columns"), given.pop("unit"), given.pop("rate")
    columns = None if names is None else tuple(name.strip() for name in names.split(","))
    return PoseFileOptions(columns=columns, unit_m=unit_m, rate_hz=rate_hz, untimed=untimed, **given)


@contextmanager
def naming_truth_flags() -> Iterator[None]:
    """Errors about the file of the reference advise its own flags."""
    flags = "|".join(name.replace("_", "-") for name in POSE_FLAGS)
    try:
        yield
    except (BadFile, BadInput) as error:
        words: list[Any] = [
            re.sub(rf"--(?={flags})", f"--{TRUTH_PREFIX}", word) if isinstance(word, str) else word
            for word in error.args
        ]
        raise type(error)(*words) from error
