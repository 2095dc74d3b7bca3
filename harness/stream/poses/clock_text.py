"""Times that are written as dates and times of day: `2024-05-01T10:00:00.123Z`, `10:00:00.123`."""

import re
from datetime import date

_CLOCK = re.compile(
    r"(?:(\d{4})[-/](\d\d)[-/](\d\d)[T_ ])?(\d{1,2}):(\d\d):(\d\d(?:[.,]\d{1,9})?)(?:Z|([+-]\d\d):?(\d\d))?"
)
DAY_S = 86400.0
_UNIX_DAY = date(1970, 1, 1).toordinal()


def parse_clock(text: str) -> float | None:
    """The Unix time of a date and time, UTC without a zone, or the seconds of a time of day; None for another text."""
    match = _CLOCK.fullmatch(text)
    if match is None:
        return None
    year, month, day, hour, minute, second, zone_hours, zone_minutes = match.groups()
    try:
        days = date(int(year), int(month), int(day)).toordinal() - _UNIX_DAY if year else 0
    except ValueError:  # no such day
        return None
    minutes = 60 * int(hour) + int(minute)
    if zone_hours:
        minutes -= 60 * int(zone_hours) + int(f"{zone_hours[0]}{zone_minutes}")
    return DAY_S * days + 60.0 * minutes + float(second.replace(",", "."))
