"""Every place that a verb writes to: one that cannot be written is refused before any work, whatever the flag."""

import argparse
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from harness.cli import build_parser
from harness.commands.flags import output_file, output_folder, output_link
from harness.errors import BadFile
from tests.command import Command
from tests.verb_examples import unpack_files, verb_parsers

OUTPUT_TYPES = (output_file, output_folder, output_link)
READ = {
    *("inspect file", "report run", "plot run", "export run", "baseline run", "status folder", "replay file"),
    *("calibrate recording", "validate capture", "trust plan", "trust captures"),
    *("replay --calibration", "bench --baseline", "characterize --expect", "validate --expect", "record --plan"),
    "characterize --surveyed",
}
"""Arguments and flags with the name of a file that is read. `--mocap` is one of every verb that has it."""
RECORDED = {"record file"}
"""Recordings, which are appended to; the writer refuses other files (`test_recording.py`)."""


def path_arguments() -> Iterator[tuple[str, argparse.Action]]:
    """Verb and argument of each place of a file."""
    for verb, parser in verb_parsers().items():
        for action in parser._actions:
            if action.type in (Path, *OUTPUT_TYPES) and action.dest != "mocap":
                yield verb, action


def name_of(verb: str, action: argparse.Action) -> str:
    return f"{verb} {action.option_strings[-1] if action.option_strings else action.dest}"


OUTPUTS = [(verb, action) for verb, action in path_arguments() if action.type in OUTPUT_TYPES]


def test_every_place_of_a_file_is_read_or_tried_before_work() -> None:
    assert {name_of(*each) for each in path_arguments()} - {name_of(*each) for each in OUTPUTS} == READ | RECORDED
    assert {verb for verb, action in OUTPUTS if action.dest == "out"} > {"run", "sweep", "placement", "trust", "view"}


@pytest.mark.parametrize(("verb", "action"), OUTPUTS, ids=[name_of(*each) for each in OUTPUTS])
def test_a_place_that_cannot_be_written_is_refused_by_the_parser(
    verb: str, action: argparse.Action, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text").write_text("hello")
    (tmp_path / "folder").mkdir()
    places = {"text/a": "text is a file, not a folder", "text/a/b": "text is a file", "/proc/a": "cannot be written"}
    of_type: dict[object, dict[str, str]] = {
        output_folder: {"text": "text is a file, not a folder"},
        output_file: {"folder": "it is not a file", "/dev/null": "it is not a file"},
        output_link: {"no_folder/a": "there is no folder no_folder"},
    }
    places |= of_type[action.type]
    for place, why in places.items():
        with pytest.raises(BadFile) as refused:
            build_parser().parse_args([*verb.split(), action.option_strings[-1], place])
        assert str(refused.value).startswith(f"{place}: ")
        assert why in str(refused.value)
        assert str(refused.value).endswith("Choose another.")
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["folder", "text"]


KEPT = {
    "calibrate": "walking.rec --out FILE",
    "plot": "run --out FILE.svg",
    "table": "run --out FILE",
    "view": "run --out FILE",
    "inspect": "constellation.mcf --out FILE",
    "characterize": "marks.rec --out FILE",
    "validate": "walking.rec --truth walking_p1_01 --out FILE",
    "compare": "baseline run --html FILE",
    "timeline": "baseline run --html FILE",
    "bench": "accuracy --save FILE --baseline ERRORS",
    "record": "sim:small.toml FILE",
    "live": "--port /dev/no_such_port --scenario small.toml --bvh FILE",
}


@pytest.mark.parametrize("verb", KEPT)
def test_a_file_of_another_program_is_not_replaced(
    verb: str, command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    errors = Path("results/baselines/accuracy/dynamic_map_40f3d61.json").absolute()
    unpack_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    for name in ("mine", "mine.svg"):
        (tmp_path / name).write_text("<!doctype html>\n<html>hello")
    words = KEPT[verb].replace("FILE", "mine").replace("ERRORS", str(errors))
    told, *_ = command(verb, *shlex.split(words), code=2).err.splitlines()
    assert told.startswith("harness: mine")
    assert "it exists" in told or "no recording" in told
    assert {(tmp_path / name).read_text() for name in ("mine", "mine.svg")} == {"<!doctype html>\n<html>hello"}


def test_a_page_of_the_harness_is_replaced(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    unpack_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    words = ["timeline", "baseline", "run", "--methods", "mean_pose", "--metrics"]
    command(*words, "mpjpe_mm", "--html", "page.html")
    first = Path("page.html").read_text()
    command(*words, "joint_angle_mean_deg", "--html", "page.html")
    assert Path("page.html").read_text() != first


@pytest.mark.parametrize(
    "words",
    [
        *("demo", "run small.toml", "sweep sweep.toml", "placement place.toml", "trust plan.toml walking.rec"),
        *("paper liu2011", "bench physics --truth", "bench lab --truth", "inspect constellation.mcf"),
        *("baseline save mine run", "mocap fetch cmu --subjects 13 --url file:///no_such_mirror"),
    ],
)
def test_the_place_that_is_taken_without_a_flag_is_tried_too(
    words: str, command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unpack_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    for name in ("results", "mocap"):
        (tmp_path / name).touch()
    (told,) = command(*words.split(), code=2).err.splitlines()
    assert re.match(r"harness: (results/\S+|mocap): \S*(results|mocap) is a file, not a folder; expected a ", told)
