"""Flags that verbs had once. Each is refused with what to write instead, and no help shows it."""

import argparse
from collections.abc import Mapping
from typing import Any

from harness.errors import BadInput

_SCENARIO = "Copy the scenario, {}, and name the copy"
_MOVIE = "`harness view RUN --clip CLIP --methods METHOD --save FILE.mp4` makes a movie of any clip"

REMOVED_FLAGS: Mapping[str, Mapping[str, str]] = {
    "calibrate": {"--live": "--port alone reads a tracker: leave --live out"},
    "characterize": {
        "--name": "A unit has the name of its recording: rename the recording",
        "--capture": "The recording lies beside --out with the suffix .rec: move it afterwards",
    },
    "emulate": {
        "--overload": _SCENARIO.format("set tracker.overload = true in it"),
        "--no-faults": _SCENARIO.format("remove its tables [[fault]]"),
        "--restart": "A restart takes 0.25 s; in Python write EmulatorConfig(restart_s=15.0)",
        "--controls": "Buttons and joystick move in turn; in Python write EmulatorConfig(controls='still')",
    },
    "live": {"--lsl-network": "Write --anywhere, as for `harness emulate`"},
    "plot": {"--format": "The suffix of --out is the format: --out FILE.svg"},
    "report": {"--movie": _MOVIE},
    "run": {"--movie": _MOVIE},
}
"""Verb -> flag -> what to write instead."""


class _Refuse(argparse.Action):
    """Raises BadInput with the advice that is the action's `const`."""

    def __call__(self, parser: Any, namespace: argparse.Namespace, values: Any, option: str | None = None) -> None:
        raise BadInput(f"`{parser.prog}` no longer has {option}.", f"{self.const}.")


def refuse_removed_flags(name: str, verb: argparse.ArgumentParser) -> None:
    """Let a verb refuse the flags that it had once, with or without a value."""
    for flag, advice in REMOVED_FLAGS.get(name, {}).items():
        verb.add_argument(flag, action=_Refuse, nargs="?", const=advice, help=argparse.SUPPRESS, dest=argparse.SUPPRESS)
