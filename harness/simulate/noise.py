"""The error model of a tracker as one record, and its three named levels (docs/is900.md 13.5)."""

from dataclasses import dataclass, fields, replace

from harness.core.seeds import generator
from harness.errors import UnknownName
from harness.simulate.events import Dropout, Echo, Excursion, LostStation, Slip
from harness.simulate.readings import Readings
from harness.simulate.smooth import Session, Slow, SpeedError, White

LEVELS = ("clean", "noise", "default")


@dataclass(frozen=True)
class Clock:
    """The device's clock against the host's."""

    offset_s: float = 0.0
    """Device time at host time 0 [s]."""
    ppm: float = 20.0
    """How much faster the device's clock runs, in millionths; docs/is900.md 13.5, ours."""


@dataclass(frozen=True)
class Noise:
    """Components that are None do nothing. They act in the order of the fields."""

    slip: Slip | None = None
    session: Session | None = None
    slow: Slow | None = None
    speed_error: SpeedError | None = None
    excursion: Excursion | None = None
    echo: Echo | None = None
    white: White | None = None
    dropout: Dropout | None = None
    lost_stations: tuple[LostStation, ...] = ()
    clock: Clock = Clock(ppm=0.0)

    def applied(self, seen: Readings, seed: int, take: str) -> Readings:
        """The readings with every component's error; each draws from generators of its own name, take and station."""
        for field in fields(self):
            value = getattr(self, field.name)
            for component in value if isinstance(value, tuple) else (value,):
                if component is not None and not isinstance(component, Clock):
                    name = field.name
                    seen = component.applied(seen, lambda s, name=name: generator(seed, "noise", take, name, s))
        return seen


def level(name: str) -> Noise:
    """`clean`: nothing; `noise`: white, slow, session and clock; `default`: all of 13.5. UnknownName."""
    if name == "clean":
        return Noise()
    noise = Noise(session=Session(), slow=Slow(), white=White(), clock=Clock())
    if name == "noise":
        return noise
    if name == "default":
        return replace(noise, speed_error=SpeedError(), excursion=Excursion(), echo=Echo(), dropout=Dropout())
    raise UnknownName("noise level", name, LEVELS)
