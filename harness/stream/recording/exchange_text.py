"""Commands and their answers as text: the bytes as they came, and what they mean."""

from collections.abc import Iterable, Mapping
from typing import Any

_SHOWN_BYTES = 120
"""Bytes of an answer that are printed; the recording has all."""
_SHOWN_RECORDS = 12
"""Data records of an answer that are printed: one of each station that a device can have."""

_LONGEST_LINE = 240
"""Characters of a printed line."""


def format_exchanges(exchanges: Iterable[Mapping[str, Any]]) -> list[str]:
    """Format commands with their answers (`Exchange.as_dict`) as lines."""
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
