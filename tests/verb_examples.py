"""A valid command of each verb, with the files of `tests/old_files`."""

import argparse
import tarfile
from collections.abc import Iterator
from pathlib import Path

from harness.cli import build_parser

ARCHIVES = Path(__file__).parent / "old_files"
NEEDS_NONE = {
    "demo": "it has a scenario of its own",
    "list": "without words it lists everything",
    "doctor": "it looks at the computer",
    "bench": "without words it runs every benchmark",
}
"""Verb that is valid without words -> why."""
EXAMPLES = {
    "mocap list": "--mocap .",
    "mocap fetch": "cmu --subjects 13 --url file:///no_such_mirror --out fetched",
    "inspect": "constellation.mcf --clip walking_p1_01 --out coverage.html",
    "view": "run --out motion.html",
    "check": "mean_pose",
    "run": "shorter.toml --out again",
    "report": "run",
    "plot": "run --out plot.svg",
    "table": "run",
    "export": "run --format csv --out exported",
    "baseline": "save old_run run",
    "compare": "baseline run --html comparison.html",
    "timeline": "baseline run --html timeline.html",
    "sweep": "sweep.toml --out again",
    "status": "run",
    "paper": "liu2011 --quick --out papers",
    "placement": "place.toml --out places",
    "emulate": "small.toml --tcp 127.0.0.1:0",
    "record": "sim:small.toml new.rec --clip walking_p1_01",
    "replay": "walking.rec",
    "calibrate": "--sheet poses",
    "live": "--port tcp://127.0.0.1:1 --scenario small.toml --method mean_pose",
    "characterize": "marks.rec --out measured.toml",
    "validate": "walking.rec --truth walking_p1_01 --out checked.toml",
    "trust": "plan.toml walking.rec boxing.rec --out trusted",
}
"""Verb -> words. Nothing answers at the port of `live`: what it prints first comes before the port is opened."""


def unpack_files(folder: Path, version: str = "23b301b7") -> None:
    """Unpack the files of a version; the examples name those of the first."""
    with tarfile.open(ARCHIVES / f"{version}.tar.xz") as archive:
        archive.extractall(folder, filter="data")


def verb_parsers() -> dict[str, argparse.ArgumentParser]:
    """Verb -> its parser; a verb with actions, such as `mocap list`, has one for each."""
    return dict(_verbs_of("", build_parser()))


def _verbs_of(name: str, parser: argparse.ArgumentParser) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    inner = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    if not inner:
        yield name, parser
    for action in inner:
        for word, each in action.choices.items():
            yield from _verbs_of(f"{name} {word}".strip(), each)
