"""Which of the device's stations are read, and what they are called."""

from dataclasses import dataclass

from harness.errors import BadInput
from harness.stream.commands import STATION_STATES, switch_station
from harness.stream.driver.line import Line
from harness.stream.replies import StationStates


@dataclass(frozen=True)
class Stations:
    """Those that are read."""

    characters: str
    """As on the wire, ascending."""
    names: tuple[str, ...]
    others: str
    """Active ones that nobody named: switched off while the driver is at work, since they would fill the line."""


def choose(port: str, line: Line, names: tuple[str, ...] | None) -> Stations:
    """The first so many active stations; BadInput when the device has fewer."""
    active = _active(port, line)
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
    return Stations(active[: len(names)], names, active[len(names) :])


def restore(port: str, line: Line, stations: Stations) -> str:
    """Switch on what is read and off what is not, as far as it is otherwise; the stations that stay missing."""
    active = _active(port, line)
    wrong = [name for name in stations.characters if name not in active] + [
        name for name in stations.others if name in active
    ]
    if not wrong:
        return ""
    for name in wrong:
        line.send(switch_station(name, name in stations.characters))
    active = _active(port, line)
    if stay := [name for name in stations.others if name in active]:
        raise BadInput(f"Port {port}: station {', '.join(stay)} cannot be switched off.", "Unplug it, or name it.")
    return "".join(name for name in stations.characters if name not in active)


def _active(port: str, line: Line) -> str:
    answer_s = line.timing.answer_s
    states = line.ask(STATION_STATES, StationStates, answer_s) or line.ask(STATION_STATES, StationStates, answer_s)
    if states is None:
        raise BadInput(f"Port {port}: the device does not say which stations it has.", "Switch it off and on.")
    return "".join(states.stations)
