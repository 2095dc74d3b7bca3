"""How an IS-900 errs: components put together, and the named levels of docs/is900.md 13.5."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from harness.errors import UnknownName
from harness.simulate.components.clock import Clock
from harness.simulate.components.drift_noise import DriftNoise
from harness.simulate.components.dropout import Dropout
from harness.simulate.components.echo import Echo
from harness.simulate.components.excursion import Excursion
from harness.simulate.components.lost_station import LostStation
from harness.simulate.components.mount import MountOffset, MountSlip
from harness.simulate.components.orientation_offset import OrientationOffset
from harness.simulate.components.position_offset import PositionOffset
from harness.simulate.components.session_bias import SessionBias
from harness.simulate.components.soft_tissue import SoftTissueArtefact
from harness.simulate.components.speed_error import SpeedError
from harness.simulate.components.strap_slip import StrapSlip
from harness.simulate.components.white_noise import WhiteNoise
from harness.simulate.readings import SimulatedReadings

NOISE_PRESETS = ("clean", "noise", "default")


@dataclass(frozen=True)
class Noise:
    """What goes wrong; None or () for what does not. Each component draws for itself, whatever else there is."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {
        "wobble": "soft_tissue",
        "loose": "strap_slip",
        "slip": "mount_slip",
        "slow": "drift",
        "displaced": "position_offset",
        "turned": "orientation_offset",
    }

    soft_tissue: SoftTissueArtefact | None = None
    mount: MountOffset | None = None
    strap_slip: StrapSlip | None = None
    mount_slip: tuple[MountSlip, ...] = ()
    speed: SpeedError | None = None
    session: SessionBias | None = None
    drift: DriftNoise | None = None
    white: WhiteNoise | None = None
    excursion: Excursion | None = None
    echo: Echo | None = None
    position_offset: tuple[PositionOffset, ...] = ()
    orientation_offset: tuple[OrientationOffset, ...] = ()
    dropout: Dropout | None = None
    lost: tuple[LostStation, ...] = ()
    clock: Clock | None = None

    def apply(self, sensed: SimulatedReadings) -> None:
        """Let every component do its work, in the order of the fields: from the body outwards to the device."""
        for component in (
            self.soft_tissue,
            self.mount,
            self.strap_slip,
            *self.mount_slip,
            self.speed,
            self.session,
            self.drift,
            self.white,
            self.excursion,
            self.echo,
            *self.position_offset,
            *self.orientation_offset,
            self.dropout,
            *self.lost,
            self.clock,
        ):
            if component is not None:
                component.apply(sensed)


def noise_preset(name: str) -> Noise:
    """`clean` (nothing), `noise` (white, slow, session, clock) or `default` (all of 13.5). UnknownName."""
    match name:
        case "clean":
            return Noise()
        case "noise":
            return Noise(white=WhiteNoise(), drift=DriftNoise(), session=SessionBias(), clock=Clock())
        case "default":
            return Noise(
                white=WhiteNoise(),
                drift=DriftNoise(),
                session=SessionBias(),
                excursion=Excursion(),
                echo=Echo(),
                dropout=Dropout(),
                speed=SpeedError(),
                clock=Clock(),
            )
    raise UnknownName("noise level", name, NOISE_PRESETS)
