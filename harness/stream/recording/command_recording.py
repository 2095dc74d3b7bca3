"""Recording of single commands and what a device answers, without any other set-up; and the answers as text."""

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from harness.errors import BadInput
from harness.stream.polhemus.codec.commands import find_danger, parse_command
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.driver.config import DriverTiming, LineConfig
from harness.stream.polhemus.driver.connection import (
    WAKE_UP,
    DeviceConnection,
    Host,
    NoAnswer,
    describe_device,
    detect_device,
)
from harness.stream.polhemus.driver.exchange import Answer, exchange, read_wire_format
from harness.stream.polhemus.driver.transport import LineLost
from harness.stream.recording.blocks import RECEIVED
from harness.stream.recording.recorder import PROGRESS_INTERVAL_S
from harness.stream.recording.recording_writer import RecordingWriter

_SHOWN_BYTES = 120
"""Bytes of an answer that are printed; the recording has all."""
_SHOWN_RECORDS = 12
"""Data records of an answer that are printed: one of each station that a device can have."""

_LONGEST_LINE = 240
"""Characters of a printed line."""


def format_exchanges(exchanges: Iterable[Mapping[str, Any]]) -> list[str]:
    """Format commands with their answers (`driver.exchange`) as lines."""
    return [line for exchange in exchanges for line in _format_exchange(exchange)]


def _format_exchange(exchange: Mapping[str, Any]) -> list[str]:
    received, answers = bytes.fromhex(exchange["received"]), exchange["answers"]
    cut = f"... ({len(received)} bytes)" if len(received) > _SHOWN_BYTES else ""
    text = repr(received[:_SHOWN_BYTES])[2:-1] + cut if received else "no answer"
    lines = [f"{exchange['command']}: {text if exchange['command'] != 'C' else 'starts the stream'}"]
    records = 0
    for answer in answers:
        records += answer["kind"] == "record"
        if answer["kind"] == "record" and records > _SHOWN_RECORDS:
            continue
        values = (f"{name} {_format_value(value)}" for name, value in answer.items() if name != "kind" and value != "")
        lines.append(f"    {answer['kind']}: {', '.join(values)}"[:_LONGEST_LINE])
    if records > _SHOWN_RECORDS:
        lines.append(f"    and {records - _SHOWN_RECORDS} more records")
    return lines


def _format_value(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        return " ".join(map(_format_value, value))
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4f}" if isinstance(value, float) else str(value).strip() or "blank"


STREAM, STOP, POLL = "C", "c", "P"


def check_commands(texts: Sequence[str], allowed: bool) -> None:
    """Raise BadInput for a text that is no command, and for one that a person must allow, unless `allowed`."""
    for text in texts:
        danger = find_danger(parse_command(text))
        if danger and not allowed:
            raise BadInput(f"--send {text!r} {danger}.", "Add --allow-writes to send it all the same.")


def record_commands(
    port: str,
    texts: Sequence[str],
    config: LineConfig,
    writer: RecordingWriter,
    *,
    seconds: float | None = None,
    log: Callable[[str], None] = lambda line: None,
    progress: Callable[[str], None] = lambda line: None,
    timing: DriverTiming | None = None,
    host: Host | None = None,
) -> list[Answer]:
    """Send commands one after another, record everything that passes, and return the commands with their answers.

    The device is stopped before the first command and after the last. A device that streams at the end is
    recorded until Ctrl-C; `seconds` [s] limits that, and otherwise waits for late answers. Of `config`, the baud rate
    and the rate count. Raises BadInput when no device answers.
    """
    used_timing, used_host = timing or DriverTiming(), host or Host()

    def connect(baud: int | None) -> DeviceConnection:
        return DeviceConnection(used_host.open(port, baud or 115200), used_host, writer, used_timing)

    exchanges: list[Answer] = []
    streaming = False
    detected = detect_device(port, config, connect, used_timing.answer_s)
    line = detected.line
    log(f"{describe_device(detected.status, config.family)} at {port}")
    try:
        with suppress(KeyboardInterrupt):
            wire: WireFormat | None = None
            for text in texts:
                if text in (STREAM, POLL) and not streaming:
                    wire = _announce_format(line, writer, config, log)
                streaming = text == STREAM or (streaming and text != STOP)
                answer = exchange(line, text, wire)
                exchanges.append(answer)
                writer.on_answer(answer)
            _listen(line, math.inf if seconds is None and streaming else seconds or 0.0, writer, progress)
    except LineLost as lost:
        raise NoAnswer(f"Port {port}: {lost.why}.", "What arrived before is recorded.") from lost
    finally:
        progress("")
        with suppress(LineLost):
            line.stop(WAKE_UP)
        line.transport.close()
    return exchanges


def _announce_format(
    line: DeviceConnection, writer: RecordingWriter, config: LineConfig, log: Callable[[str], None]
) -> WireFormat | None:
    """Write the format of the records that follow, so that `harness replay` decodes them."""
    try:
        wire = read_wire_format(line, config.rate_hz, config.family)
    except BadInput as error:
        log(f"{error} Every byte is recorded, but no frames can be replayed.")
        return None
    writer.on_configured(wire)
    return wire


def _listen(
    line: DeviceConnection, duration_s: float, writer: RecordingWriter, progress: Callable[[str], None]
) -> None:
    """Record what arrives for this long [s]."""
    until_s = time.monotonic() + duration_s
    while (left_s := until_s - time.monotonic()) > 0.0:
        line.listen(min(left_s, PROGRESS_INTERVAL_S))
        progress(f"{1e-3 * writer.counts[RECEIVED]:.0f} kB")
