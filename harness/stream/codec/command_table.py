"""Every command of docs/is900.md 4, and which of them a person must allow: those that last, restart or erase."""

import re
from dataclasses import dataclass

from harness.errors import BadInput
from harness.stream.codec.commands import LONGEST_LINE, Command, CommandReader

SAVES = "writes the device's memory"
RESTARTS = "restarts the device"
RESETS = "resets every setting of the device"
LINE = "changes the line, and may end the connection"
ERASES = "changes or erases what the device has stored"
EMITTERS = "changes the emitter constellation, on which all tracking rests"
NETWORK = "changes the device's network settings"
LOCKS = "locks or unlocks the device's configuration"
TESTS = "runs a self-test; one of them is said to free a device that hangs"
OTHER_PRODUCT = "belongs to another product; no source says what an IS-900 does with it"
UNKNOWN = "is in no source"


@dataclass(frozen=True)
class DeviceCommand:
    """One command of the protocol. Control characters are written `^K`."""

    name: str
    danger: str = ""
    """Why a person must allow it; "" where it only reads, or sets what ends when the device is switched off."""
    set_danger: str = ""
    """Why a person must allow it where values follow; "" as above, or for the same reason as without values."""


_HARMLESS = (
    "P C c F f U u S ^Q ^S O l A R G B b H N V x v MS Ms Mp MF MQ MH Mh MT Mt MZ MBI MBF MB MG MGP MGS MP MU Mg "
    "ML0 ML1 MLB ME ME0 ME1 MLogState MLogSend MSchAlg MInfoSystem"
)
_DANGEROUS = (
    DeviceCommand("^K", SAVES),
    DeviceCommand("^Y", RESTARTS),
    DeviceCommand("W", RESETS),
    DeviceCommand("o", LINE, LINE),
    *(DeviceCommand(name, OTHER_PRODUCT, OTHER_PRODUCT) for name in ("T", "e", "t", "Y", "MCM", "MCm", "MCc", "MCi")),
    *(DeviceCommand(name, EMITTERS, EMITTERS) for name in ("MCf", "MCC", "MCe", "MCx")),
    DeviceCommand("MCF", set_danger=EMITTERS),
    DeviceCommand("MCI", set_danger=OTHER_PRODUCT),
    *(DeviceCommand(name, ERASES) for name in ("MEC", "MLogOpen", "MLogClose", "MLogClear")),
    *(DeviceCommand(name, set_danger=NETWORK) for name in ("MEthIp", "MEthUdp", "MEthUdpPort")),
    DeviceCommand("MConfigLockMode", set_danger=LOCKS),
    *(DeviceCommand(name, TESTS, TESTS) for name in ("MSystemTest1", "MSystemTest2")),
)
DEVICE_COMMANDS = {command.name: command for command in (*map(DeviceCommand, _HARMLESS.split()), *_DANGEROUS)}
"""Commands by name."""
_LONGEST_FIRST = sorted(DEVICE_COMMANDS, key=len, reverse=True)
_ARGUMENT = re.compile(r"[0-9A-Ca-c*., +-]*")
"""Stations and numbers; other letters make a command that is in no source."""
_SETS_WITHOUT_COMMA = ("MEthIp", "MEthUdp", "MEthUdpPort", "MConfigLockMode")


def parse_command(text: str) -> Command:
    """Parse one command as a person writes it: `O1,2,4,1`, `S`, or `^K`. Raises BadInput unless it is exactly one."""
    if not (text.isascii() and text.isprintable()) or not 0 < len(text) <= LONGEST_LINE:
        raise BadInput(
            f"{text[:40]!r} is no command.",
            f"Give 1 to {LONGEST_LINE} printable ASCII characters, and ^K, ^Q, ^S or ^Y for control characters.",
        )
    control = re.fullmatch(r"\^([KQSY])", text)
    data = bytes([ord(control[1]) - ord("@")]) if control else text.encode("ascii")
    commands = CommandReader().feed(data + b"\r")
    if len(commands) != 1:
        names = " and ".join(repr(command.line.decode("ascii")) for command in commands)
        raise BadInput(f"{text!r} is {len(commands)} commands: {names}.", "Send each by itself.")
    return commands[0]


def find_danger(command: Command) -> str:
    """Return why a person must allow this command; "" where nobody must."""
    text = command.line.decode("ascii")
    if command.immediate:
        return DEVICE_COMMANDS[text if text.isprintable() else f"^{chr(ord(text) + ord('@'))}"].danger
    name = next((name for name in _LONGEST_FIRST if text.startswith(name)), None)
    if name is None or not _ARGUMENT.fullmatch(text, len(name)):
        return UNKNOWN
    argument = text[len(name) :]
    sets = "," in argument or (name in _SETS_WITHOUT_COMMA and argument != "")
    return (sets and DEVICE_COMMANDS[name].set_danger) or DEVICE_COMMANDS[name].danger
