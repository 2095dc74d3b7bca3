"""Commands and their answers, one after another, with a device that is left as it is: nothing else is set."""

from typing import Any

import numpy as np

from harness.errors import BadInput
from harness.stream.polhemus.codec import commands, replies
from harness.stream.polhemus.codec.commands import parse_command
from harness.stream.polhemus.codec.decoder import Decoder, DecoderEvent, RecordRun, Reply
from harness.stream.polhemus.codec.items import MOST_DEVICE_HZ, DeviceFamily
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.codec.readings import decode_readings
from harness.stream.polhemus.codec.records import RecordFormat
from harness.stream.polhemus.driver.connection import DeviceConnection

Answer = dict[str, Any]
"""A decoded answer: its kind and its values; or a command with all of its answers."""
_CONTROLS = ("buttons", "joystick")


def exchange(line: DeviceConnection, text: str, wire: WireFormat | None) -> Answer:
    """Send a command as a person writes it, and return it with what comes back until silence; bytes are hexadecimal.

    `answers` are each reply, data record and stretch of other bytes, in sequence, with SI units. `wire` is the format
    of data records, if known.

    A device that streams never falls silent; it is heard for twice `answer_s`. `C` has no answer but the stream itself,
    of which nothing is collected.
    """
    command = parse_command(text)
    sent = command.line if command.immediate else command.line + b"\r\n"
    line.send(sent)
    received = b"" if sent == commands.STREAM else line.listen_until_silence()
    return {
        "command": text,
        "sent": sent.hex(" "),
        "received": received.hex(" "),
        "answers": decode_answers(received, wire),
    }


def read_wire_format(line: DeviceConnection, rate_hz: float | None, family: DeviceFamily = "is900") -> WireFormat:
    """Ask in which format the device would send data records; nothing is set. The device must not stream.

    `rate_hz` is the rate of a device that does not report it [Hz]. Raises BadInput where the answers do not suffice.
    """
    answer_s = line.timing.answer_s
    status = line.ask(commands.STATUS, replies.StatusRecord, answer_s)
    fastrak = family == "fastrak"
    system = None if fastrak else line.ask(commands.SYSTEM, replies.SystemRecord, answer_s)
    states_query = commands.station_command("l", "1") if fastrak else commands.STATION_STATES
    states = line.ask(states_query, replies.StationStates, answer_s)
    if status is None or states is None or not states.stations:
        raise BadInput("The device does not tell its format and its active stations (S, l).", "")
    lists = {
        station: line.ask(commands.station_command("O", station), replies.OutputList, answer_s)
        for station in states.stations
    }
    items = {answer.items for answer in lists.values() if answer is not None}
    if None in lists.values() or len(items) != 1:
        raise BadInput("The stations have different output lists, or do not tell them (O).", "")
    if rate_hz is None and fastrak:
        rate_hz = MOST_DEVICE_HZ[family] / len(states.stations)
    elif rate_hz is None:
        tracking = line.ask(commands.TRACKING, replies.TrackingStatus, answer_s)
        rate_hz = tracking.rate_hz if tracking is not None else 0.0
    if not rate_hz > 0.0:
        raise BadInput("The device does not report its rate (MP).", "Give --rate.")
    settings = RecordFormat(
        metres_per_unit=0.01 if status.centimetres else 0.0254,
        seconds_per_tick=1e-6 if system is not None and system.microseconds else 1e-3,
        binary=status.binary,
    )
    characters = "".join(states.stations).encode()
    return WireFormat(states.stations, rate_hz, items.pop(), settings, characters, zeroed=False, family=family)


def decode_answers(data: bytes, wire: WireFormat | None) -> list[Answer]:
    """Decode replies, and data records where their format is known."""
    if wire is None:
        return [_decode_reply(line) for line in data.split(b"\n") if line.strip(b"\r")]
    decoder = Decoder(dict.fromkeys(wire.characters, wire.items), wire.settings)
    events: list[DecoderEvent] = [*decoder.feed(data), *decoder.finish()]
    answers: list[Answer] = []
    for event in events:
        if isinstance(event, RecordRun):
            answers += _decode_records(event, wire)
        else:
            line = event.line if isinstance(event, Reply) else data[event.offset : event.offset + event.size]
            answers.append(_decode_reply(line))
    return answers


def _decode_reply(line: bytes) -> Answer:
    reply = replies.parse_reply(line)
    match reply:
        case replies.UnknownReply():
            values: Answer = {"text": reply.text.decode("latin-1")}
        case replies.StationStates():
            values = {"station": reply.station, "active": "".join(reply.stations)}
        case _:
            values = dict(vars(reply))
    return {"kind": type(reply).__name__, **values}


def _decode_records(run: RecordRun, wire: WireFormat) -> list[Answer]:
    """Decode data records: time [s], position [m], unit quaternion, quality 0 to 1, buttons and joystick as sent."""
    readings = decode_readings(run.table, np.zeros(len(run.table)), wire.characters, wire.settings)
    names: tuple[str, ...] = run.table.dtype.names or ()
    answers: list[Answer] = []
    for row, record in enumerate(run.table):
        columns = {
            "measured_s": readings.measured_s[row],
            "position_m": readings.position_m[row],
            "tracker_from_station": readings.tracker_from_station[row],
            "quality": readings.quality[row] if {40, 76} & set(wire.items) else np.nan,
        }
        values = {name: np.round(value, 9).tolist() for name, value in columns.items() if np.all(np.isfinite(value))}
        controls: Answer = {name: record[name].tolist() for name in _CONTROLS if name in names}
        answers.append({"kind": "record", "station": chr(record["station"]), **values, **controls})
    return answers
