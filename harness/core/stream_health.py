"""The health of a stream in a sentence: records that the line dropped, and stations that hear few emitters."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import count_noun, format_share

LEAST_ARRIVED = 0.9
"""Least share of the records that has to arrive, unless the scenario allows the overload. The driver and the emulator
refuse every overload; a tenth leaves room for bursts [choice]."""
RECORD_BYTES, BAUD = "record_bytes", "line_baud"
"""Keys in the health of a stream whose line let nothing be measured: the size of a record and the line's bit rate."""

READING_AGE = "reading_age_ms"
"""Key in the health of a stream whose line may drop records: the mean age of the stations' newest readings [ms]."""


def excess_loss(health: Mapping[str, Any], *, allowed: bool) -> float:
    """The share of a stream's records that the line dropped; 0 if it is `allowed` or within `LEAST_ARRIVED`."""
    dropped, records = _counts(health)
    return dropped / records if not allowed and dropped > (1.0 - LEAST_ARRIVED) * records else 0.0


def describe_line_loss(streams: Iterable[Mapping[str, Any]]) -> str:
    """A sentence on the records that the line dropped in streams, which are rows of cells; "" if it dropped none.

    Where the line let nothing be measured, the cause and what to do follow, for the first such stream.
    """
    rows = list(streams)
    dropped, records = map(sum, zip(*(_counts(row["health"]) for row in rows), strict=True)) if rows else (0.0, 0.0)
    if not dropped:
        return ""
    unmeasured = [row for row in rows if BAUD in row["health"]]
    text = f"THE LINK IS TOO SLOW: {format_share(dropped / records)} of the records were dropped"
    if ages_ms := [float(row["health"][READING_AGE]) for row in rows if READING_AGE in row["health"]]:
        text += f"; stations' newest readings were {sum(ages_ms) / len(ages_ms):.0f} ms old on average"
    return f"{text}; {_describe_cause(unmeasured)}" if unmeasured else text


def _describe_cause(rows: list[Mapping[str, Any]]) -> str:
    row = rows[0]
    health, stations, rate_hz = row["health"], len(row["stations"]), float(row["rate_hz"])
    record_bytes, baud = int(health[RECORD_BYTES]), int(health[BAUD])
    dropped, records = _counts(health)
    record_bits = 10 * record_bytes * stations
    load = f"{stations} stations x {record_bytes} bytes x 10 bits x {rate_hz:g} Hz"
    load += f" are {record_bits * rate_hz:,.0f} bit/s"
    if record_bits * rate_hz > baud:
        cause = f"{load}, but the line carries {baud:,}"
        highest_hz = baud // record_bits
        remedy = f"tracker.rate_hz = {highest_hz} or less" if highest_hz else "a lower tracker.rate_hz"
        remedy += ", a higher tracker.baud, fewer stations or shorter tracker.items"
    else:
        cause = f"{load} of the line's {baud:,}, but records come in bursts that the queue does not hold"
        remedy = "a larger tracker.queue_records or another tracker.slot_s"
    return (
        f"{dropped:,.0f} of {records:,.0f} on {row['clip']}: {cause}. {count_noun(len(rows), 'cell')} not measured. "
        f"Choose {remedy}. If the slow line is what the scenario studies, set tracker.overload = true"
    )


def mean_reading_age_s(measured_s: Floats, period_s: float) -> float:
    """Mean age of the newest readings of S stations over frames (F, S) of device times [s], which are NaN for none.

    The age is that at the newest reading of a frame, one period after that of the frame before where a frame has none.
    Stations count from their first reading on; NaN if there is none.
    """
    instant_s, newest_s, total_s, count = np.nan, np.full(measured_s.shape[1], np.nan), 0.0, 0
    for row_s in measured_s:
        present = np.isfinite(row_s)
        newest_s[present] = row_s[present]
        instant_s = row_s[present].max() if present.any() else instant_s + period_s
        known = np.isfinite(newest_s)
        total_s += float(np.sum(instant_s - newest_s[known]))
        count += int(known.sum())
    return total_s / count if count else float("nan")


def _counts(health: Mapping[str, Any]) -> tuple[float, float]:
    """The numbers of dropped records and of all records."""
    dropped, sent = (float(health.get(name) or 0.0) for name in ("records_dropped", "records_sent"))
    return dropped, dropped + sent


ENOUGH_EMITTERS = 3
"""Number of emitters that a position needs."""
LEAST_SHARE = 0.5
"""Share of the time below which a station is reported [choice]."""
_ENDING = f" hears {ENOUGH_EMITTERS} emitters"


def hearing_key(station: str) -> str:
    """Key in the stream's health of the share of time in which a station hears enough emitters."""
    return station + _ENDING


GROWN_ROOM = "room_length_m", "room_width_m", "room_height_m", "room_emitters"
"""Keys in the stream's health of a room that is larger than usual: its sizes [m] and its number of emitters."""


def describe_grown_room(health: Mapping[str, float]) -> str:
    """A sentence on a room that motion or emitters have made larger than usual; "" without one."""
    if GROWN_ROOM[0] not in health:
        return ""
    length, width, height, emitters = (health[key] for key in GROWN_ROOM)
    return f"the room is {length:g} m by {width:g} m and {height:.2f} m high, with {emitters:.0f} emitters"


def poor_hearing(health: Mapping[str, float]) -> str:
    """A sentence on the stations that hear enough emitters for less than half of the time; "" if there are none."""
    shares = {key.removesuffix(_ENDING): share for key, share in health.items() if key.endswith(_ENDING)}
    poor = [f"{station} for {100.0 * share:.0f} %" for station, share in shares.items() if share < LEAST_SHARE]
    if not poor:
        return ""
    first = poor[0].replace(" for ", " hears three emitters for ", 1)
    return ", ".join([f"{first} of the time", *poor[1:]])
