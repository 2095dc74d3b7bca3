"""The stations of the device that are read: selected, and switched on and off."""

from collections.abc import Callable
from dataclasses import dataclass

from harness.errors import BadInput
from harness.stream.polhemus.codec.commands import STATION_STATES, TRACKING, station_command
from harness.stream.polhemus.codec.items import STATION_CHARACTERS
from harness.stream.polhemus.codec.replies import StationStates, TrackingStatus
from harness.stream.polhemus.driver.connection import DeviceConnection


@dataclass(frozen=True)
class StationSelection:
    """The stations that are read, and the active ones that are not."""

    characters: str
    """Their characters on the wire, ascending."""
    names: tuple[str, ...]
    others: str
    """Active stations without a name. They are switched off while the driver runs, since they would load the line."""
    woken: str = ""
    """Selected stations that were off. They are switched off again at the end."""


StationQuery = Callable[[str, DeviceConnection, str], str]
"""Returns the active stations of the device at a port; or the last argument where the device does not tell."""


def select_stations(
    port: str,
    line: DeviceConnection,
    names: tuple[str, ...] | None,
    characters: str | None,
    query: StationQuery,
) -> StationSelection:
    """Select the stations with these characters, or the first active ones, as many as there are names.

    Raises BadInput when the device lacks one. A device that does not report its stations is assumed to have the named
    ones.
    """
    if names is not None and characters is not None:
        return _select_mapped(port, line, names, characters, query)
    active = query(port, line, STATION_CHARACTERS.decode()[: len(names or ())])
    if not active:
        raise BadInput(f"Port {port}: no station of the device is active.", "Plug one in, or switch it on: l1,1.")
    names = tuple(active) if names is None else names
    if not 1 <= len(names) <= len(active):
        raise BadInput(
            f"Port {port}: {len(names)} stations requested ({', '.join(names)}), the device has {len(active)} active "
            f"({', '.join(active)}).",
            "Name at most the active ones, plug in the missing ones, or switch the device off and on: another "
            "program may have switched stations off.",
        )
    return StationSelection(active[: len(names)], names, active[len(names) :])


def _select_mapped(
    port: str, line: DeviceConnection, names: tuple[str, ...], characters: str, query: StationQuery
) -> StationSelection:
    """Select the stations with these characters; one that is off is switched on."""
    before = active = query(port, line, characters)
    for character in characters:
        if character not in before:
            line.send(station_command("l", character, [True]))
    if not set(characters) <= set(before):
        active = query(port, line, characters)
    if missing := [f"{c} ({name})" for c, name in zip(characters, names, strict=True) if c not in active]:
        free = [c for c in active if c not in characters]
        raise BadInput(
            f"Port {port}: the device has no station {', '.join(missing)}; it has {', '.join(active) or 'none'}.",
            f"Plug it in, or name another one{': free are ' + ', '.join(free) if free else ''}.",
        )
    others = "".join(c for c in active if c not in characters)
    return StationSelection(characters, names, others, "".join(c for c in characters if c not in before))


def restore_stations(port: str, line: DeviceConnection, stations: StationSelection, query: StationQuery) -> str:
    """Switch on the selected stations and switch off the others where needed; return those that stay missing.

    Raises BadInput when a station cannot be switched off.
    """
    active = query(port, line, stations.characters)
    wrong = [name for name in stations.characters if name not in active] + [
        name for name in stations.others if name in active
    ]
    if not wrong:
        return ""
    for name in wrong:
        line.send(station_command("l", name, [name in stations.characters]))
    active = query(port, line, stations.characters)
    if stubborn := [name for name in stations.others if name in active]:
        raise BadInput(f"Port {port}: station {', '.join(stubborn)} cannot be switched off.", "Unplug it, or name it.")
    return "".join(name for name in stations.characters if name not in active)


def query_active(port: str, line: DeviceConnection, fallback: str) -> str:
    """Return the active stations of an IS-900 by `l*`, or by `MP`, because old firmware may know only that.

    `fallback` is returned when the device answers neither. Raises BadInput when it is empty.
    """
    answer_s = line.timing.answer_s
    states = line.ask(STATION_STATES, StationStates, answer_s) or line.ask(STATION_STATES, StationStates, answer_s)
    if states is not None:
        return "".join(states.stations)
    tracking = line.ask(TRACKING, TrackingStatus, answer_s)
    if tracking is not None:
        return "".join(
            name for name, state in zip(STATION_CHARACTERS.decode(), tracking.states, strict=True) if state in "TL"
        )
    if not fallback:
        raise BadInput(
            f"Port {port}: the device answers neither l* nor MP, so its stations are not known.",
            "Name the stations that are plugged in, from the first on, or switch the device off and on.",
        )
    return fallback
