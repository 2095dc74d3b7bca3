"""What `emulate`, `record` and `live` play: a clip of a scenario, as the flags of the command line ask for it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from harness.commands.flags import is_whole_number, parse_device_names

if TYPE_CHECKING:
    from harness.experiment import Playback
    from harness.experiment.scenarios import Scenario
    from harness.mocap import LibraryFolders

DEFAULT_STATION_COUNT = 4
"""Default number of stations of a device: VRPN takes no more (docs/is900.md 11.1)."""
DEVICE_STATIONS_HELP = (
    "number of the scenario's stations, or their names, in the order of the device's active stations; or names with "
    "stations of the device: head=3,torso=1 (default: the first 4)"
)


@dataclass(frozen=True)
class PlaybackOptions:
    """The scenario that is played, and what differs from it."""

    scenario: str
    stations: int | Sequence[str] | None
    """Number of the scenario's stations, or their names; None as `every_station` says."""
    clip: str | None
    """None plays the scenario's first test clip."""
    rate_hz: float | None
    seed: int | None
    folder: "LibraryFolders | None"
    """Folders of real motion."""
    noise: str | None = None
    posing: bool = False
    """Whether the calibration poses are played instead of the clip."""
    every_station: bool = False
    """Whether all stations are played where none are given, and not as many as a device has by default."""


def open_playback(options: PlaybackOptions) -> "Playback":
    """The playback that the options ask for; UnknownName, BadFile and BadInput as for a run of the scenario."""
    from harness.experiment import prepare_playback
    from harness.experiment.scenarios import load_scenario

    stations = options.stations
    if stations is None and not options.every_station:
        stations = default_station_count(load_scenario(options.scenario))
    return prepare_playback(
        options.scenario,
        clip=options.clip,
        stations=stations,
        rate_hz=options.rate_hz,
        noise=options.noise,
        seed=options.seed,
        folder=options.folder,
        posing=options.posing,
    )


def default_station_count(scenario: "Scenario") -> int:
    """Number of a scenario's stations that a device has by default."""
    return min(DEFAULT_STATION_COUNT, len(scenario.worn_stations))


def parse_device_stations(text: str | None, port: str = "") -> int | list[str] | None:
    """A number of stations at a port, or their names, from `--stations`; None without it, BadInput for an empty name.

    The names may have stations of the device (`head=3`); they are then in the order of the device.
    """
    if text is None:
        return None
    return int(text) if is_whole_number(text) else parse_device_names(text, port)
