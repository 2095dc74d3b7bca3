"""What verbs refuse: the word `refused`, a line that says why, and nothing is written."""

import os
import shlex
from pathlib import Path

import pytest

from harness.core.package_data import data_folder
from harness.mocap import MOCAP_VARIABLE
from harness.stream.recording import FILE_HEADER
from tests.command import Command
from tests.stream.recording.test_recording import newer_file

DEVICE = "tcp://127.0.0.1:1"
LIVE = "live --port /dev/no_such_port --scenario demo --clip boxing_p1_01 --method ik"
EMULATE = "emulate builtin_walking --pty is900"
CASES = [
    ("calibrate", "No source of poses"),
    ("calibrate --port x --simulate 3", "2 sources: port, simulate"),
    ("calibrate a.rec --port x", "2 sources: recording, port"),
    ("calibrate a.rec", "--out is missing"),
    ("calibrate a.rec --out me.toml --rate 40", "--rate with recording. It applies to port"),
    ("calibrate --simulate 3 --out me.toml", "--out with simulate. It applies to recording or port"),
    ("calibrate --simulate 3 --kind tpose", "--kind with simulate. It applies to recording or port"),
    ("calibrate --simulate 3 --miss 90", "--miss 90"),
    ("calibrate --simulate 3 --noise loud", "loud"),
    ("calibrate --simulate 0", "not a positive whole number"),
    ("calibrate --out me.toml --scenario demo", "No source of poses"),
    ("calibrate --out me.toml --port x", "--port without --scenario"),
    ("calibrate --out me.toml --port x --pictures there", "--pictures without --view frames"),
    ("calibrate --out me.toml --port no_such_port --scenario demo", "no such port"),
    ("calibrate no_such.rec --out me.toml --scenario demo", "no_such.rec"),
    ("calibrate a.rec --out text.rec/me.toml", "text.rec/me.toml: text.rec is a file, not a folder"),
    ("calibrate a.rec --kind npose", "no choice of --kind called 'npose'. Did you mean 'tpose'?"),
    (LIVE, "no such port"),
    (f"{LIVE} --method dynamic_mop", "Did you mean 'dynamic_map'"),
    (f"{LIVE} --scenario nothing", "no scenario called 'nothing'"),
    (f"{LIVE} --stations nose", "no station called 'nose'"),
    (f"{LIVE} --stations nose=3,torso=1", "no station called 'nose'"),
    (f"{LIVE} --stations 9", "9 stations of 6"),
    (f"{LIVE} --stations {'9' * 5000}", "no station called '999"),
    (f"{LIVE} --vmc nowhere", "is not an address"),
    (f"{LIVE} --view frames", "needs a folder"),
    (f"{LIVE} --bvh text.rec/x.bvh", "text.rec is a file, not a folder"),
    (f"{LIVE} --bvh a.bvh --poses a.csv", "no such port"),
    (f"{LIVE} --lsl ''", "The argument after '--lsl' is empty"),
    (f"{LIVE} --out there", "--out without --view frames"),
    (f"{LIVE} --view browser --out text.rec/a", "text.rec is a file, not a folder"),
    (f"{LIVE} --view frames --out /proc/nothing", "the folder /proc cannot be written"),
    (f"{LIVE} --calibration poses --poses text.rec", "text.rec: it exists"),
    ("trust no.toml no.rec --out text.rec", "text.rec is a file, not a folder"),
    ("mocap fetch cmu --subjects 91 --out text.rec", "text.rec is a file, not a folder"),
    ("characterize no.rec --out /proc/unit.toml", "/proc/unit.toml: the folder /proc cannot be written"),
    ("view walking_p1_01 --out text.rec/a.html", "text.rec is a file, not a folder"),
    ("view walking_p1_01 --save text.rec/a.gif", "text.rec is a file, not a folder"),
    (f"{LIVE} --anywhere", "--anywhere without --lsl"),
    (f"{LIVE} --seconds soon", "not a positive number"),
    (f"{LIVE} --items '40;2'", "not a list such as"),
    (f"{LIVE} --items 2,11,21,1", "(--quality mp)"),
    (f"{LIVE} --clip walking_p1_01 --items 40,18,19,21,1", "carries positions up to 3 m"),
    (f"{LIVE} --quality best", "no choice of --quality called 'best'. Known: record, mp."),
    (f"{LIVE} --port {DEVICE} --baud 9600", f"--baud with {DEVICE}"),
    (f"{LIVE} --stations ''", "The argument after '--stations' is empty"),
    (f"{LIVE} --calibration tposes", "Did you mean 'tpose'"),
    (f"{LIVE} --calibration no_such.toml", "no_such.toml: no such file"),
    (f"{EMULATE} --rate 120", "18240 bytes/s; a line of 115200 baud carries 11520. Try --stations 2"),
    (f"{EMULATE} --baud 9600", "a line of 9600 baud carries 960. Try --rate 6;"),
    ("emulate demo --pty is900 --clip boxing_p1_01 --rate 131 --items 40,18,19,21,1", "11528 bytes/s"),
    (f"{EMULATE} --items 40,18,19,21,1", "list 40,18,19,21,1 (22 bytes, range 3 m) carries less"),
    (f"{EMULATE} --stations 7", "7 stations of 6"),
    (f"{EMULATE} --stations head,tail", "no station called 'tail'"),
    (f"{EMULATE} --clip nobody_01", "nobody_01"),
    ("emulate no_such_scenario --pty is900", "no scenario called"),
    (f"{EMULATE} --firmware new", "such as 4.2301"),
    (f"{EMULATE} --baud 115201", "An IS-900 supports 300"),
    (f"{EMULATE} --rate 1000000", "rate_hz = 1000000.0. Give a number from 1 to 1000."),
    *((f"{EMULATE} --rate={rate}", f"{rate!r} is not a positive number") for rate in ("-5", "0", "nan", "inf", "fast")),
    (f"{EMULATE} --anywhere", "--anywhere with --pty"),
    (f"{EMULATE} --noise loud", "loud"),
    ("emulate walking --pty is900", "HARNESS_MOCAP"),
    ("emulate builtin_walking --pty text.rec", "no link of an emulator"),
    ("emulate builtin_walking --tcp 0.0.0.0:0", "--anywhere"),
    ("emulate builtin_walking --tcp 127.0.0.1:²", "is no HOST:PORT"),
    ("emulate builtin_walking --tcp 127.0.0.1:0 --check-baud", "--check-baud with --tcp"),
    ("placement", "Neither a study nor a question. Type: harness placement --stations 3 --behaviour table_tennis"),
    ("placement walking --stations 3", "--stations with the study walking. A study has its own"),
    ("placement --stations 3 --places hand_r,head", "no place called 'hand_r'. Did you mean 'hand'?"),
    (
        "placement --stations 3 --places head,,hand",
        "The list 'head,,hand' has an empty name. Separate names by commas.",
    ),
    ("placement --behaviour table_tenis", "no behaviour called 'table_tenis'. Did you mean 'table_tennis'?"),
    ("placement --behaviour ,", "The list ',' has an empty name."),
    ("placement --stations 4 --places head,hand", "4 to 4 stations of 3 places."),
    ("placement --stations 1 --method ikk", "no method called 'ikk'"),
    *((f"placement --stations={text}", "is no number of stations") for text in ("x", "2-", "-3", "1-2-3", "''")),
    ("inspect hal.mcf", "no constellation called 'hal'. Did you mean 'hall'?"),
    ("inspect no/hall.mcf", "no such file"),
    ("inspect two.mcf", "two.mcf: 2 emitters; expected 3 or more"),
    ("inspect bad.mcf", "bad.mcf, line 2: the line"),
    ("inspect hall.mcf --unit 0.01", "An MCF file is in metres."),
    ("inspect hall.mcf --stations kim2012", "--stations without --clip."),
    ("inspect hall.mcf --rate 120", "--rate without --clip."),
    ("inspect hall.mcf --clip walking_p1_1", "walking_p1_1"),
    ("inspect hall.mcf --clip no.bvh", "no.bvh"),
    ("inspect hall.mcf --clip walking_p1_01 --stations kim2011", "Did you mean 'kim2012'?"),
    ("inspect a.bvh --clip walking_p1_01", "--clip with a.bvh. It is for an MCF file of emitters."),
    ("inspect a.bvh --out x.html", "It is for an MCF file of emitters."),
    ("inspect a.bvh --force", "It is for an MCF file of emitters."),
    ("replay new.rec", "a recording of version 3; expected version 2 at most"),
    ("replay text.rec", "no recording; expected a recording by `harness record`"),
    ("replay empty.rec", "an empty file"),
    ("replay bare.rec", "the device was never configured in it"),
    ("replay none.rec", "no such file"),
    ("replay RECORDING --speed fast", "Speed 'fast' is not possible. Give `step`, `max`, or a positive number"),
    ("replay RECORDING --methods il", "no method called 'il'"),
    ("replay RECORDING --scenario dem", "no scenario called 'dem'"),
    ("replay RECORDING --clip walking_p1_01 --methods ik:previous", "of another motion"),
    ("record sim:dem b.rec", "no scenario called 'dem'"),
    ("record sim:demo text.rec", "no recording"),
    ("record sim:demo new.rec", "a recording of version 3"),
    ("record sim:demo b.rec --stations 13", "13 stations of 6"),
    ("record sim:demo b.rec --stations a,,b", "The list 'a,,b' has an empty name."),
    ("record sim:demo b.rec --stations ²", "no station called '²'"),
    ("record sim:demo b.rec --stations head=3", "'head=3' names stations of a device"),
    ("record sim:demo b.rec --seconds -1", "--seconds -1."),
    ("record sim:demo b.rec --quality mp", "--quality with sim:demo"),
    ("record sim:demo b.rec --send S", "--send with sim:demo"),
    ("record sim:demo b.rec --boresight", "--boresight with sim:demo"),
    ("record sim:demo RECORDING --clip boxing_p1_01", "Record other stations into another file"),
    ("record /dev/nothing b.rec", "there is no such port"),
    ("record b.rec /dev/null", "The port comes first"),
    (f"record {DEVICE} b.rec", "127.0.0.1:1"),
    (f"record {DEVICE} b.rec --seed 3", f"--seed with {DEVICE}"),
    (f"record {DEVICE} b.rec --baud 9600", f"--baud with {DEVICE}"),
    (f"record {DEVICE} b.rec --stations ''", "'--stations' is empty"),
    (f"record {DEVICE} b.rec --items 2,11,21,1", "(--quality mp)"),
    (f"record {DEVICE} b.rec --items 40,²", "is not a list such as"),
    (f"record {DEVICE} b.rec --baud ²", "is not a positive whole number"),
    (f"record {DEVICE} b.rec --rate -1", "is not a positive number"),
    (f"record {DEVICE} b.rec --rate nan", "is not a positive number"),
    (f"record {DEVICE} b.rec --quality best", "no choice of --quality called 'best'. Known: record, mp."),
    (f"record {DEVICE} b.rec --allow-writes", "--allow-writes without --send"),
    (f"record {DEVICE} b.rec --send S --items 2,4,1", "--items with --send"),
    (f"record {DEVICE} b.rec --send S --stations head", "--stations with --send"),
    (f"record {DEVICE} b.rec --send S --boresight", "--boresight with --send"),
    (f"record {DEVICE} b.rec --send SW", "'SW' is 2 commands"),
    (f"record {DEVICE} b.rec --send S", "nothing listens"),
    (f"record {DEVICE} b.rec --serve link --keep-settings", "--keep-settings with --serve"),
    ("record udp://127.0.0.1:1 b.rec --serve link", "--serve with udp://127.0.0.1:1. UDP carries no commands"),
    ("record udp://127.0.0.1:1 b.rec --send S", "--send with udp://127.0.0.1:1. UDP carries no commands"),
    *(
        (f"record {DEVICE} b.rec --alignment {text}", "is not nine numbers")
        for text in ("1,2,3", "0,0,0,1,0,0,0,1,nan", "0,0,0,1,0,0,0,1,x", "0,0,0,1,0,0,0,1,inf")
    ),
]


@pytest.mark.parametrize(("words", "said"), CASES)
def test_what_is_refused_says_why_and_writes_nothing(
    words: str, said: str, simulated: Path, command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(MOCAP_VARIABLE, raising=False)
    lines = (data_folder("models") / "constellations" / "cave.mcf").read_bytes().splitlines(keepends=True)
    files = {
        "text.rec": b"hello\n",
        "empty.rec": b"",
        "bare.rec": FILE_HEADER,
        "new.rec": newer_file(),
        "two.mcf": b"".join(lines[1:3]),
        "bad.mcf": lines[0] + b"\x00\x01" + b"".join(lines[1:]),
    }
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    recorded = simulated.read_bytes()
    ended = command(*(simulated if word == "RECORDING" else word for word in shlex.split(words)), code=2)
    assert ended.out == "refused\n"
    told = ended.err.splitlines()
    assert said in told[-1]
    assert sum(line.startswith("harness: ") for line in told) <= 1
    assert {name: (tmp_path / name).read_bytes() for name in os.listdir()} == files
    assert simulated.read_bytes() == recorded
