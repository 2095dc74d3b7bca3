"""All settings of the device as one immutable value, which is saved and restored by keeping it."""

from dataclasses import dataclass, field, replace

from harness.stream.codec.replies import Emitter

STATION_NAMES = "123456789ABC"
DEFAULT_OUTPUT_LIST = (2, 4, 1)
"""Position, angles, CR LF (docs/is900.md 12)."""
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
ZERO_VECTOR: Vector = (0.0, 0.0, 0.0)
IDENTITY_QUATERNION: Quaternion = (1.0, 0.0, 0.0, 0.0)
DEFAULT_EMITTERS = tuple(
    Emitter(
        1 + 3 * row + column, (0.9144 * row - 0.9144, 0.6096 * column - 0.6096, 0.0), (0.0, 0.0, 1.0), 5001 + number
    )
    for number, (row, column) in enumerate((row, column) for row in range(3) for column in range(3))
)
"""Three bars of three emitters that face down. They are made up, except for the spacings and the form of the first
number."""


@dataclass(frozen=True)
class StationSettings:
    """Settings of one station."""

    active: bool = False
    items: tuple[int, ...] = DEFAULT_OUTPUT_LIST
    origin_m: Vector = ZERO_VECTOR
    """Origin of the alignment frame in the tracker frame [m]."""
    tracker_from_aligned: Quaternion = IDENTITY_QUATERNION
    heading_boresight: Quaternion = IDENTITY_QUATERNION
    """Boresight of the heading: rotates reported orientations about the frame's own axes."""
    full_boresight: Quaternion = IDENTITY_QUATERNION
    """Full boresight: rotates the station's axes."""
    reference_deg: Vector = ZERO_VECTOR
    """Yaw, pitch and roll that the next boresight gives the present orientation (`G`) [deg]."""
    hemisphere: Vector = (1.0, 0.0, 0.0)
    """Hemisphere vector of a Fastrak (`H`); stored without effect."""
    tip_m: Vector = ZERO_VECTOR
    """Tip offset in the station's own axes [m]."""
    envelope_m: tuple[float, ...] = (10.0, 10.0, 10.0, -10.0, -10.0, -10.0)
    prediction_ms: int = 0
    enhancement: int = 0
    sensitivity: int = 3
    compass: int = 0

    @property
    def plain(self) -> bool:
        """Whether readings are reported as they were taken."""
        return (
            self.origin_m == self.tip_m == ZERO_VECTOR
            and self.tracker_from_aligned == self.heading_boresight == self.full_boresight == IDENTITY_QUATERNION
        )


@dataclass(frozen=True)
class DeviceSettings:
    """Settings of the device; the defaults are those after power-on (docs/is900.md 12)."""

    stations: tuple[StationSettings, ...] = field(default_factory=lambda: (StationSettings(),) * len(STATION_NAMES))
    binary: bool = False
    centimetres: bool = False
    microseconds: bool = False
    boresight_as_fastrak: bool = False
    lights: bool = True
    brightness: int = 100
    timeout_ms: int = 20
    """Ultrasonic time-out [ms]; the default is a choice."""
    gain: int = 1
    """Ultrasonic sensitivity; the default is a choice."""
    genlock: str = "0"
    genlock_hz: float = 0.0
    genlock_source: int = 1
    genlock_phase: float = 0.0
    emitters: tuple[Emitter, ...] = DEFAULT_EMITTERS
    draft_emitters: tuple[Emitter, ...] = DEFAULT_EMITTERS
    """Emitters that `MCe` would activate."""
    error_log: bool = True
    command_log: bool = False
    scheduling: int = 1
    lock: int = 0
    address: str = "192.168.1.10"
    udp: bool = False
    udp_port: int = 5001
    baud: int = 115200
    framing: tuple[str, int, int] = ("N", 8, 0)
    """Parity, bits and hardware handshake; stored without effect."""

    def station(self, name: str) -> StationSettings:
        """Return the settings of the station with this character."""
        return self.stations[STATION_NAMES.index(name)]

    def with_station(self, name: str, station: StationSettings) -> "DeviceSettings":
        """Return a copy in which this station has other settings."""
        k = STATION_NAMES.index(name)
        return replace(self, stations=(*self.stations[:k], station, *self.stations[k + 1 :]))
