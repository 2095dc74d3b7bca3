"""Which of the device's stations are read, and what they are called."""

from dataclasses import dataclass

from harness.errors import BadInput
from harness.stream.codec.commands import STATION_STATES, TRACKING, switch_station
from harness.stream.codec.items import STATION_CHARACTERS
from harness.stream.codec.replies import StationStates, TrackingStatus
from harness.stream.driver.connection import DeviceConnection


@dataclass(frozen=True)
class StationSelection:
    """Those that are read."""

    characters: str
    """As on the wire, ascending."""
    names: tuple[str, ...]
    others: str
    """Active ones that nobody named: switched off while the driver is at work, since they would fill the line."""


def select_stations(port: str, line: DeviceConnection, names: tuple[str, ...] | None) -> StationSelection:
    """The first so many active stations; BadInput when the device has fewer.

    A device that does not say which it has is believed to have those that are named.
    """
    active = _query_active(port, line, STATION_CHARACTERS.decode()[: len(names or ())])
    if not active:
        raise BadInput(f"Port {port}: no station of the device is active.", "Plug one in, or switch it on: l1,1.")
    names = tuple(active) if names is None else names
    if not 1 <= len(names) <= len(active):
        raise BadInput(
            f"Port {port}: {len(names)} stations wanted ({', '.join(names)}), the device has {len(active)} active "
            f"({', '.join(active)}).",
            "Name as many as there are or fewer, plug in what is missing, or switch the device off and on: another "
            "program may have switched stations off.",
        )
    return StationSelection(active[: len(names)], names, active[len(names) :])


def restore_stations(port: str, line: DeviceConnection, stations: StationSelection) -> str:
    """Switch on what is read and off what is not, as far as it is otherwise; the stations that stay missing."""
    active = _query_active(port, line, stations.characters)
    wrong = [name for name in stations.characters if name not in active] + [
        name for name in stations.others if name in active
    ]
    if not wrong:
        return ""
    for name in wrong:
        line.send(switch_station(name, name in stations.characters))
    active = _query_active(port, line, stations.characters)
    if stay := [name for name in stations.others if name in active]:
        raise BadInput(f"Port {port}: station {', '.join(stay)} cannot be switched off.", "Unplug it, or name it.")
    return "".join(name for name in stations.characters if name not in active)


def _query_active(port: str, line: DeviceConnection, silent: str) -> str:
    """By `l*`, or by `MP`, which old firmware may know alone; `silent` when the device answers neither. BadInput."""
    answer_s = line.timing.answer_s
    states = line.ask(STATION_STATES, StationStates, answer_s) or line.ask(STATION_STATES, StationStates, answer_s)
    if states is not None:
        return "".join(states.stations)
    tracking = line.ask(TRACKING, TrackingStatus, answer_s)
    if tracking is not None:
        return "".join(
            name for name, state in zip(STATION_CHARACTERS.decode(), tracking.states, strict=True) if state in "TL"
        )
    if not silent:
        raise BadInput(
            f"Port {port}: the device does not answer l* nor MP, so which stations it has is not known.",
            "Name the stations that are plugged in, from the first on, or switch it off and on.",
        )
    return silent
