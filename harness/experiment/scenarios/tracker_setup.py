"""The trackers of a scenario: what is worn where, the device, and what goes wrong."""

from dataclasses import dataclass

from harness.body import Mount, locate_mounts
from harness.core.humanoid24 import standard_skeleton
from harness.errors import UnknownName
from harness.simulate import Noise, TrackerConfig
from harness.simulate.physics import check_emitters, load_constellation
from harness.stream import make_inputs
from harness.stream.is900.codec import WireFormat


@dataclass(frozen=True)
class TrackerSetup:
    """The trackers of one variant of a scenario, complete once built.

    UnknownName and BadInput for inputs, bones, stations and emitters that do not exist, and for what does not fit.
    """

    stations: tuple[str, ...]
    """Names of all stations."""
    mounts: tuple[Mount, ...]
    """Nominal mounts of those that are worn."""
    inputs: tuple[str, ...]
    """Which of position and orientation they deliver, see `make_inputs`."""
    device: TrackerConfig
    noise: Noise

    def __post_init__(self) -> None:
        worn = tuple(mount.station for mount in self.mounts)
        for name in self.inputs:
            make_inputs(name, worn)
        WireFormat(worn, self.device.rate_hz, self.device.items)
        locate_mounts(standard_skeleton(), self.mounts)
        for slip in self.noise.mount_slip:
            if slip.station not in self.stations:
                raise UnknownName("station", slip.station, self.stations)
        if self.noise.physics is not None:
            emitters = load_constellation(self.noise.physics.constellation)
            check_emitters(self.noise.physics.room, self.device.origin_m[2], emitters.number, emitters.position_m)
