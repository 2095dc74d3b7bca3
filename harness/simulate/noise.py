"""Error model of an IS-900: error components, and the noise presets of docs/is900.md 13.5."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

from harness.errors import BadInput, UnknownName
from harness.simulate.components.faults import LostStation, OrientationOffset, PositionOffset
from harness.simulate.components.mount import MountOffset, MountSlip, StrapSlip
from harness.simulate.components.soft_tissue import SoftTissueArtefact
from harness.simulate.components.stationary import Clock, DriftNoise, SessionBias, SpeedError, WhiteNoise
from harness.simulate.components.transient import Dropout, Echo, Excursion
from harness.simulate.physics.settings import Physics
from harness.simulate.readings import SimulatedReadings

NOISE_PRESETS = ("clean", "noise", "default")
"""Names of the presets that `noise_preset` makes."""
STATISTICAL_COMPONENTS = ("speed", "session", "drift", "white", "excursion", "echo", "dropout")
"""Components that describe errors whose causes `Physics` simulates."""


class ErrorComponent(Protocol):
    """One component of the errors."""

    def apply(self, readings: SimulatedReadings) -> None: ...


@dataclass(frozen=True)
class Noise:
    """A set of error components; None or () leaves one out. Each has its own independent random draws.

    With `physics` the errors of the tracker are computed from their causes. The statistical components are then refused
    (BadInput), because they would count twice.
    """

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
    physics: Physics | None = None

    def __post_init__(self) -> None:
        if self.physics is None:
            return
        twice = [name for name in STATISTICAL_COMPONENTS if getattr(self, name) is not None]
        if twice:
            raise BadInput(
                f"components.{twice[0]} would count twice: [physics] computes this error from its cause.",
                "Remove the component, or the table [physics].",
            )
        if any(slip.over_s == 0.0 for slip in self.mount_slip) or (self.strap_slip and self.strap_slip.over_s == 0.0):
            raise BadInput(
                "A slip with over_s = 0 has an infinite acceleration, which [physics] cannot measure.",
                "Give the slip a duration, such as over_s = 0.1.",
            )

    def apply(self, readings: SimulatedReadings) -> None:
        """Apply every component in place, in the order of the fields: from the body outwards to the device.

        With `physics`, readings contain the motion of the worn tracker and the errors of the device already; faults and
        clock remain.
        """
        for component in (
            *(self._body_and_statistical() if self.physics is None else ()),
            *self.position_offset,
            *self.orientation_offset,
            self.dropout,
            *self.lost,
            self.clock,
        ):
            if component is not None:
                component.apply(readings)

    def _body_and_statistical(self) -> "tuple[ErrorComponent | None, ...]":
        worn = (self.soft_tissue, self.mount, self.strap_slip, *self.mount_slip)
        return (*worn, self.speed, self.session, self.drift, self.white, self.excursion, self.echo)


def noise_preset(name: str) -> Noise:
    """Preset `clean` (no errors), `noise` (white, drift, session, clock) or `default` (all of 13.5); UnknownName."""
    match name:
        case "clean":
            return Noise()
        case "noise":
            return Noise(white=WhiteNoise(), drift=DriftNoise(), session=SessionBias(), clock=Clock())
        case "default":
            every_reading = noise_preset("noise")
            return replace(every_reading, excursion=Excursion(), echo=Echo(), dropout=Dropout(), speed=SpeedError())
    raise UnknownName("noise preset", name, NOISE_PRESETS)
