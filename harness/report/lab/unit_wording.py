"""A measured unit in words: its faults first, then what it is like."""

import math
from collections.abc import Sequence

from harness.core.interval import Interval
from harness.core.number_format import count_noun, format_fixed
from harness.report.lab.departure_wording import departures_sentence
from harness.report.lab.quantities import format_value, quantity
from harness.report.lab.unit_content import RecordingAdvice, UnitReport


def answer(report: UnitReport) -> str:
    """The faults of the unit in one sentence."""
    return departures_sentence(report.name, report.checks, report.expected_from)


def description(report: UnitReport) -> list[str]:
    """What the unit is like, in short sentences; numbers that were not measured are left out."""
    values = {row.key: row.measured for row in (*report.parameters, *report.timing) if row.measured.is_measured}
    return [
        sentence
        for sentence in (
            _spread_sentence(report),
            _noise_sentence(values),
            _excursion_sentence(values),
            _share_sentence(values),
            _timing_sentence(values),
        )
        if sentence
    ]


def _spread_sentence(report: UnitReport) -> str:
    spreads = {
        name: [found for row in report.stations if (found := row.figures.get(name)) and found.is_measured]
        for name in ("spread_m", "spread_rad")
    }
    parts = [
        f"{noun} scatters by {_range(numbers, f'station.{name}')}"
        for (name, numbers), noun in zip(spreads.items(), ("a position", "an orientation"), strict=True)
        if numbers
    ]
    return f"At rest, {' and '.join(parts)} (RMS, everything included)." if parts else ""


def _range(numbers: Sequence[Interval], key: str) -> str:
    shown = quantity(key)
    least, most = min(n.value for n in numbers), max(n.value for n in numbers)
    ends = [format_fixed(shown.factor * value, 2) for value in (least, most)]
    return f"{ends[0]} {shown.unit}" if ends[0] == ends[1] else f"{ends[0]} to {ends[1]} {shown.unit}"


def _noise_sentence(values: dict[str, Interval]) -> str:
    parts = [
        f"{format_value(values[key], quantity(key))} of {noun}"
        for key, noun in (
            ("components.white.position_m", "white noise"),
            ("components.drift.position_m", "drift"),
        )
        if key in values
    ]
    lasting = values.get("components.drift.correlation_s")
    tail = f", which lasts {format_value(lasting, quantity('components.drift.correlation_s'))}" if lasting else ""
    return f"On each axis a position has {' and '.join(parts)}{tail}." if parts else ""


def _excursion_sentence(values: dict[str, Interval]) -> str:
    rate = values.get("components.excursion.onsets_per_min")
    if rate is None:
        return ""
    number = format_value(rate, quantity("components.excursion.onsets_per_min"), with_unit=False)
    size, stay = (_ends_text(values, f"components.excursion.{name}") for name in ("size_m", "stay_s"))
    tail = "".join([f" of {size}" if size else "", f" for {stay}" if stay else ""])
    return f"A station has {number} excursions a minute{tail}."


def _ends_text(values: dict[str, Interval], key: str) -> str:
    ends = [values.get(f"{key}.{i}") for i in (0, 1)]
    shown = quantity(f"{key}.0")
    if ends[0] is not None and ends[1] is not None:
        low, high = (format_value(end, shown, with_unit=False) for end in ends if end is not None)
        return f"{low} to {high} {shown.unit}"
    return format_value(values[key], quantity(key)) if key in values else ""


def _share_sentence(values: dict[str, Interval]) -> str:
    parts = [
        f"{format_value(values[key], quantity(key))} are {noun}"
        for key, noun in (
            ("components.echo.share", "echoes"),
            ("components.dropout.share", "lost"),
            ("timing.duplicate_share", "sent twice"),
        )
        if key in values
    ]
    return (
        f"Of the readings {' and '.join([', '.join(parts[:-1]), parts[-1]] if parts[1:] else parts)}." if parts else ""
    )


def _timing_sentence(values: dict[str, Interval]) -> str:
    rate = values.get("tracker.rate_hz") or values.get("timing.rate_hz")
    clock = values.get("components.clock.drift_ppm")
    parts = []
    if rate:
        parts.append(f"records of a station come at {format_value(rate, quantity('tracker.rate_hz'))}")
    if clock:
        size = format_value(_absolute(clock), quantity("components.clock.drift_ppm"))
        parts.append(f"the clock runs {size} {'fast' if clock.value >= 0.0 else 'slow'}")
    text = " and ".join(parts)
    return f"{text[0].upper()}{text[1:]}." if text else ""


def _absolute(number: Interval) -> Interval:
    """The size of a number, with the interval on the same side."""
    if number.value >= 0.0:
        return number
    return Interval(-number.value, -number.high, -number.low, number.count)


def advice_text(advice: RecordingAdvice) -> str:
    """How long to record for a wanted precision."""
    label, percent = quantity(advice.key).label, f"{100.0 * advice.precision:g} %"
    had = f"This capture has {count_noun(advice.events, 'event')} in {_minutes(advice.minutes)}"
    if advice.events >= advice.needed_events:
        return (
            f"To know the {label} to {percent}: {had.lower()}, which is enough ({advice.needed_events:,} are needed)."
        )
    if not math.isfinite(advice.needed_minutes):
        return f"To know the {label} to {percent}: {advice.needed_events:,} events are needed. {had}: no rate to go by."
    needed = f"record {_minutes(advice.needed_minutes)} at this rate ({advice.needed_events:,} events)"
    return f"To know the {label} to {percent}: {needed}. {had}."


def _minutes(minutes: float) -> str:
    return f"{format_fixed(minutes, 1 if minutes < 10.0 else 0, grouped=True)} min"
