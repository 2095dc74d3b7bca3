"""How long stations hear enough emitters for a position, in the health of a stream and in a sentence."""

from collections.abc import Mapping

ENOUGH_EMITTERS = 3
"""Number of emitters that a position needs."""
LEAST_SHARE = 0.5
"""Share of the time below which a station is reported [choice]."""
_ENDING = f" hears {ENOUGH_EMITTERS} emitters"


def hearing_key(station: str) -> str:
    """Key in the stream's health of the share of time in which a station hears enough emitters."""
    return station + _ENDING


def poor_hearing(health: Mapping[str, float]) -> str:
    """A sentence on the stations that hear enough emitters for less than half of the time; "" if there are none."""
    shares = {key.removesuffix(_ENDING): share for key, share in health.items() if key.endswith(_ENDING)}
    poor = [f"{station} for {100.0 * share:.0f} %" for station, share in shares.items() if share < LEAST_SHARE]
    if not poor:
        return ""
    first = poor[0].replace(" for ", " hears three emitters for ", 1)
    return ", ".join([f"{first} of the time", *poor[1:]])
