"""Commands as bytes and back: the framing of docs/is900.md 3, and what real clients send (11)."""

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.errors import BadInput
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.polhemus.codec import commands
from harness.stream.polhemus.codec.commands import (
    DEVICE_COMMANDS,
    LONGEST_LINE,
    Command,
    CommandReader,
    find_danger,
    parse_command,
    station_command,
)
from harness.stream.polhemus.emulator.config import EmulatorConfig
from tests.stream.is900.driver.bench import NAMES, Bench, EmulatedDevice, frames_for, make_samples
from tests.stream.is900.emulator.played import DeviceSession


def read(data: bytes) -> list[bytes]:
    return [command.line for command in CommandReader().feed(data)]


@pytest.mark.parametrize(
    ("data", "lines"),
    [
        (b"fCMT\rMZ\r", [b"f", b"C", b"MT", b"MZ"]),
        (b"cS", [b"c", b"S"]),
        (b"O1,2,11,0\rO2,2,11,0\r", [b"O1,2,11,0", b"O2,2,11,0"]),
        (b"x0.2,0.2,0.8,0.8\rv0.2,0.2,0.8,0.8\r", [b"x0.2,0.2,0.8,0.8", b"v0.2,0.2,0.8,0.8"]),
        (b"c*resetMS\r\n", [b"c", b"*resetMS"]),
        (b"fuC\x11SMG\r\n", [b"f", b"u", b"C", b"\x11", b"S", b"MG"]),
        (
            b"cFUSl*\nMCF\nMP\nO1,40,2,4,1\n\rO1\r",
            [b"c", b"F", b"U", b"S", b"l*", b"MCF", b"MP", b"O1,40,2,4,1", b"O1"],
        ),
        (b"l1,1\r\nR1\r\nb1\r\nMp1,0\r\nMF1,0\r\nMQ1,3\r\n", [b"l1,1", b"R1", b"b1", b"Mp1,0", b"MF1,0", b"MQ1,3"]),
        (b"tY\x19c", [b"\x19", b"c"]),
        (b"\r\n\r\n\n", []),
        (b"M\x13S\r", [b"\x13", b"MS"]),
        (b"W\x0b", [b"W", b"\x0b"]),
    ],
    ids=lambda given: given[:8].decode("latin-1") if isinstance(given, bytes) else "",
)
def test_commands_of_real_clients_are_parsed(data: bytes, lines: list[bytes]) -> None:
    assert read(data) == lines


@given(
    st.lists(st.sampled_from([b"c", b"S", b"\x19", b"\x0b", b"O1,2\r", b"MZ\r\n", b"\n", b"M", b"l*", b"\xff"])),
    st.data(),
)
def test_any_split_gives_the_same_commands(parts: list[bytes], choose: st.DataObject) -> None:
    data = b"".join(parts)
    cut = choose.draw(st.integers(0, len(data)))
    reader = CommandReader()
    assert reader.feed(data[:cut]) + reader.feed(data[cut:]) == CommandReader().feed(data)


def test_an_endless_line_is_truncated_and_the_next_is_read() -> None:
    reader = CommandReader()
    out: list[Command] = []
    for _ in range(1000):
        out += reader.feed(b"x" * 1000)
    assert out == []
    assert reader.feed(b"\rMZ\r") == [Command(b"x" * LONGEST_LINE, cut=True), Command(b"MZ")]


@pytest.mark.parametrize(
    ("command", "expected_bytes"),
    [
        (station_command("O", "1", (40, 2, 11, 21, 1)), b"O1,40,2,11,21,1\r\n"),
        (station_command("O", "A"), b"OA\r\n"),
        (station_command("l", "2", [False]), b"l2,0\r\n"),
        (station_command("N", "1", (0, -2.5, 30.0), 3), b"N1,0.000,-2.500,30.000\r\n"),
    ],
)
def test_commands_are_those_of_the_manuals(command: bytes, expected_bytes: bytes) -> None:
    assert command == expected_bytes
    assert read(command) == [expected_bytes[:-2]]


def test_immediate_commands_need_no_terminator() -> None:
    for byte in commands.IMMEDIATE_LETTERS + commands.CONTROL_CHARACTERS:
        assert CommandReader().feed(bytes([byte])) == [Command(bytes([byte]))]
        assert Command(bytes([byte])).immediate
    assert not Command(b"MZ").immediate


PAGE = (Path(__file__).parents[4] / "docs" / "is900.md").read_text(encoding="utf-8")
FASTRAK = PAGE.partition("### 4.1")[2].partition("### 4.2")[0]
INTERSENSE = PAGE.partition("### 4.2")[2].partition("### 4.3")[0]
AS_BUILT = PAGE.partition("### 4.3")[2].partition("## 5")[0]

EXAMPLES = {
    "P": "P", "C": "C", "c": "c", "F": "F", "f": "f", "U": "U", "u": "u", "S": "S", "W": "W",
    "O{st},a,b,...": "O1,2,4,1", "O{st}": "O1", "l{st},0|1": "l2,1", "l{st}": "l1", "l*": "l*", "l": "l",
    "A{st},": "A1,0,0,0,1,0,0,0,1,0", "A{st}": "A1", "R{st}": "R1", "G{st},y,p,r": "G1,0,0,0", "G{st}": "G1",
    "B{st}": "B1", "b{st}": "b1", "H{st},x,y,z": "H1,0,0,0", "H{st}": "H1", "N{st},x,y,z": "N1,0,0,0", "N{st}": "N1",
    "V{st},": "V1,1,1,1,-1,-1,-1", "V{st}": "V1", "^K": "^K", "^Y": "^Y", "^S": "^S", "^Q": "^Q",
    "o...": "o1152,N,8,0", "T": "T", "x...": "x0.2,0.2,0.8,0.8", "v...": "v0.2,0.2,0.8,0.8", "e...": "e1,0",
    "t": "t", "Y": "Y",
    "MS": "MS", "Ms{st}": "Ms1", "Mp{st}": "Mp1", "Mp{st},ms": "Mp1,20", "MF{st},0|1|2": "MF1,2", "MQ{st}": "MQ1",
    "MQ{st},n": "MQ1,3", "MH{st},0|1|2": "MH1,0", "Mh": "Mh1", "MT": "MT", "Mt": "Mt", "MZ": "MZ", "MBI": "MBI",
    "MBF": "MBF", "MG": "MG", "MG<state>,<rate>": "MG1,60", "MGP": "MGP1", "MGS": "MGS1", "MP": "MP", "MU": "MU20",
    "Mg": "Mg1", "MCF": "MCF", "MCF{n}": "MCF1", "MCF{n},x,y,z,nx,ny,nz,id": "MCF1,0,0,0,0,0,1,5001",
    "MCf{n}[,id]": "MCf1,5001", "MCC": "MCC", "MCe": "MCe", "MCx": "MCx", "MCI{st}[,n]": "MCI1", "MCi": "MCi1",
    "MCM": "MCM",
    "MCm": "MCm", "MCc": "MCc", "ML0": "ML0", "ML1": "ML1", "MLB{n}": "MLB50", "ME": "ME", "MEC": "MEC",
    "ME0|1": "ME1", "MLogOpen/Close/Clear/State/Send": "MLogSend", "MSchAlg1|2": "MSchAlg1",
    "MConfigLockMode0|1|2": "MConfigLockMode1", "MEthIp": "MEthIp", "MEthUdp": "MEthUdp",
    "MEthUdpPort": "MEthUdpPort", "MInfoSystem": "MInfoSystem", "MSystemTest1": "MSystemTest1",
    "MSystemTest2": "MSystemTest2",
}  # fmt: skip
"""An example of each command, by how the tables of docs/is900.md 4 write it."""
NEED_PERMISSION = {
    "W", "^K", "^Y", "o...", "T", "e...", "t", "Y", "MCF{n},x,y,z,nx,ny,nz,id", "MCf{n}[,id]", "MCC", "MCe", "MCx",
    "MCi", "MCM", "MCm", "MCc", "MEC", "MConfigLockMode0|1|2", "MSystemTest1", "MSystemTest2",
}  # fmt: skip
"""Those that write the device's memory, restart or reset it, erase, change the line, or are of other products."""
SENT_BY_THE_DRIVER = {
    *("C", "c", "F", "f", "U", "u", "S", "^Q", "O{st},a,b,...", "O{st}", "l{st},0|1", "l*", "A{st},", "A{st}", "R{st}"),
    *("B{st}", "b{st}", "G{st}", "N{st}", "MS", "Ms{st}", "Mp{st}", "MQ{st}", "MT", "Mt", "MZ", "MP"),
}


def documented_commands() -> set[str]:
    """Commands in the first column of the tables, as they are written there."""
    rows = [line.split(" | ")[0] for line in (FASTRAK + INTERSENSE).splitlines() if line.startswith("| ")]
    spans = {span.replace("\\|", "|") for row in rows for span in re.findall(r"`([^`]+)`", row)}
    return spans


def test_every_documented_command_has_an_example_here() -> None:
    assert documented_commands() == set(EXAMPLES)


@pytest.mark.parametrize("written", EXAMPLES)
def test_every_documented_command_can_be_sent(written: str) -> None:
    command = parse_command(EXAMPLES[written])
    assert bool(find_danger(command)) is (written in NEED_PERMISSION)
    sent = CommandReader().feed(command.encode())
    assert [one.line for one in sent] == [command.line]


def test_no_other_command_is_known() -> None:
    """`MB` is described in the row of `MBI`; the others share a row with an example."""
    names = {max((n for n in DEVICE_COMMANDS if example.startswith(n)), key=len) for example in EXAMPLES.values()}
    assert set(DEVICE_COMMANDS) - names == {"MB", "ME0", "MLogOpen", "MLogClose", "MLogClear", "MLogState"}


@pytest.mark.parametrize("written", EXAMPLES)
def test_the_emulator_executes_all_but_the_commands_of_other_products(written: str) -> None:
    session = DeviceSession()
    unknown = b"EC -99" in session.send(parse_command(EXAMPLES[written]).encode())
    assert unknown is (written in {"T", "e...", "t", "Y", "MCM", "MCm", "MCc"})


@pytest.mark.parametrize(
    ("text", "danger"),
    [
        ("MLogClear", "erases"), ("MLogOpen", "erases"), ("MLogState", ""), ("ME", ""), ("ME0", ""),
        ("MEthIp", ""), ("MEthIp10.0.0.7", "network"), ("MEthUdp1", "network"), ("MEthUdpPort5002", "network"),
        ("MCI1,2", "other product|another product"), ("MConfigLockMode", ""), ("MCF1,2", "constellation"),
        ("MCf1", "constellation"),
        ("MCf1,5001", "constellation"), ("MCC,", "constellation"), ("MEC,", "erases"), ("MLogClear,1", "erases"),
        ("Q", "in no source"), ("MTx", "in no source"), ("*reset", "in no source"), ("Oz", "in no source"),
    ],
)  # fmt: skip
def test_danger_depends_on_what_follows_the_name(text: str, danger: str) -> None:
    found = find_danger(parse_command(text))
    assert re.search(danger, found) if danger else found == ""


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "no command"), ("SW", "2 commands: 'S' and 'W'"), ("S\r", "no command"), ("fC", "2 commands"),
        ("O1\x19", "no command"), ("é", "no command"), ("O1," + "2," * 200, "no command"), ("\x0b", "no command"),
    ],
)  # fmt: skip
def test_a_text_that_is_not_one_command_is_refused(text: str, complaint: str) -> None:
    with pytest.raises(BadInput, match=complaint):
        parse_command(text)


def test_the_driver_sends_the_commands_that_the_list_names() -> None:
    """It is watched through all of its set-ups: every unit and clock, alignment, boresight, old firmware, a spare
    station.
    """
    sent = b""
    square = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    for config, firmware in (
        (DriverConfig(boresight=True, alignment=square, stations=NAMES[:1]), "4.2301"),
        (DriverConfig(centimetres=False, milliseconds=False, quality="mp"), "4.1105"),
    ):
        bench = Bench(EmulatedDevice(make_samples(2), EmulatorConfig(firmware=firmware), 1000.0))
        with bench.driver(config) as driver:
            frames_for(driver, bench, 0.5)
        sent += bytes(bench.sent)
    lines = {command.line.decode("latin-1") for command in CommandReader().feed(sent)}
    for written in SENT_BY_THE_DRIVER:
        name = re.match(r"\^?[A-Za-z]+", EXAMPLES[written])[0]  # type: ignore[index]
        form = {"^Q": "\x11", "l*": r"l\*"}.get(name, name)
        values = r"[1-9A-C],.+" if "," in EXAMPLES[written] else "[1-9A-C]" if "{st}" in written else ""
        assert any(re.fullmatch(form + values, line) for line in lines) or EXAMPLES[written] in lines, written


def test_the_page_says_who_sends_what() -> None:
    """Its first row names what the driver sends; its last two what needs permission."""
    rows = [line for line in AS_BUILT.splitlines() if line.startswith("| ")][1:]
    driver, _, permission, others = ({*re.findall(r"`([A-Za-z0-9]+)", row.split(" | ")[0])} for row in rows)
    names = {re.match(r"[A-Za-z]+", EXAMPLES[written]) for written in SENT_BY_THE_DRIVER - {"^Q"}}
    # These are sent where another program changed them (tests/stream/is900/driver/test_shared_device.py).
    assert driver == {name[0] for name in names if name} | {"MF", "MBI", "MBF"}
    dangerous = {name for name, command in DEVICE_COMMANDS.items() if command.danger or command.set_danger}
    with_value = {"MEthIp", "MEthUdp", "MEthUdpPort", "MConfigLockMode"}
    assert permission | others | with_value == dangerous - {"^K", "^Y"}
    assert "`MEthIp`, `MEthUdp`, `MEthUdpPort` and `MConfigLockMode` with a value" in AS_BUILT


@given(st.one_of(st.text(max_size=300), st.from_regex(r"\^?[A-Za-z]{1,4}[0-9A-C*,. -]{0,8}", fullmatch=True)))
def test_any_text_is_refused_or_exactly_one_command(text: str) -> None:
    try:
        command = parse_command(text)
    except BadInput:
        return
    sent = CommandReader().feed(command.encode())
    assert [one.line for one in sent] == [command.line]
    dangerous = {0x0B, 0x19, ord("W")}
    assert find_danger(command) or not dangerous & set(command.line[:1])
