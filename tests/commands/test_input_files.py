"""Every verb that reads a file, with a missing, empty and binary one, a folder, and a file of each other kind."""

import shlex
from pathlib import Path

import pytest

from tests.command import Command
from tests.verb_examples import unpack_files

FILES = {
    "missing.toml": "no such file",
    "empty.toml": "",
    "binary.toml": "binary data",
    "folder.toml": "",
    "motion.bvh": "a BVH motion",
    "small.toml": "a scenario",
    "sweep.toml": "a sweep",
    "place.toml": "a placement study",
    "plan.toml": "a trust plan",
    "poses.toml": "a calibration",
    "unit.toml": "a unit file",
    "walking.rec": "a recording",
    "constellation.mcf": "a list of emitters",
    "run/summary.json": "a file of results",
}
"""File -> what the message calls it; "" where verbs call it differently."""
LIVE = "live --port /dev/no_such_port --method mean_pose --scenario"
READERS = {
    "inspect FILE": ("motion.bvh", "walking.rec", "constellation.mcf"),
    "view FILE --out page.html": ("motion.bvh", "walking.rec"),
    "run FILE": ("small.toml",),
    "sweep FILE": ("sweep.toml",),
    "placement FILE": ("place.toml",),
    "emulate FILE --tcp 127.0.0.1:0": ("small.toml",),
    "record sim:FILE new.rec": ("small.toml",),
    "record sim:small.toml new.rec --plan FILE": ("plan.toml",),
    "record sim:small.toml FILE --seconds 1": ("walking.rec", "missing.toml", "empty.toml"),
    "replay FILE": ("walking.rec",),
    "replay walking.rec --methods mean_pose --calibration FILE": ("poses.toml",),
    "calibrate FILE --out new.toml": ("walking.rec",),
    f"{LIVE} FILE": ("small.toml",),
    f"{LIVE} small.toml --calibration FILE": ("poses.toml",),
    "characterize FILE": ("walking.rec",),
    "characterize marks.rec --expect FILE": ("unit.toml",),
    "validate FILE --truth walking_p1_01": ("walking.rec",),
    "validate walking.rec --truth FILE": ("walking.rec", "motion.bvh"),
    "trust FILE walking.rec": ("plan.toml",),
    "trust plan.toml FILE": ("walking.rec",),
    "compare ./FILE run": (),
    "timeline ./FILE run": (),
    "table FILE": (),
    "report FILE": (),
    "report run --readme FILE": tuple(name for name in FILES if name not in ("missing.toml", "binary.toml")),
    "plot FILE": (),
    "export FILE --format csv": (),
    "status FILE": (),
    "baseline save new FILE": (),
    "bench accuracy --baseline FILE": (),
}
"""Words -> files that are good there."""
NAMES_NOTHING = ("codec", "None", "Rename", "Known:", "Traceback")
"""What no such message has."""


@pytest.mark.parametrize("words", READERS)
def test_a_wrong_file_is_named_with_what_it_is_and_what_to_do(
    words: str, command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unpack_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.toml").touch()
    (tmp_path / "binary.toml").write_bytes(bytes(range(256)))
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "motion.bvh").write_text("HIERARCHY\nROOT hip\n")
    for name, kind in FILES.items():
        if name in READERS[words]:
            continue
        ended = command(*shlex.split(words.replace("FILE", name)), code=2)
        (told,) = [line for line in ended.err.splitlines() if line.startswith("harness: ")]
        assert told.startswith(f"harness: {name}: "), told
        assert kind in told or (name == "missing.toml" and "no such folder" in told), told
        assert told.endswith("."), told
        assert [word for word in NAMES_NOTHING if word in told] == [], told
