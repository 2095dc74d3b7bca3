"""The configuration of an IS-900 that a user requests."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from harness.errors import BadInput
from harness.stream.polhemus.codec.items import STANDARD_LIST, position_range_m
from harness.stream.polhemus.codec.records import RecordFormat
from harness.stream.polhemus.driver.config import LineConfig, join_commas

QUALITY_ITEMS = (40, 76)
"""Items that report how well a station is tracked (docs/is900.md 7)."""

Alignment = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
"""Origin, a point on +X and a point on +Y of the frame that a station reports in [m]."""


@dataclass(frozen=True)
class DriverConfig(LineConfig):
    """The requested configuration of an IS-900. Raises BadInput where it is contradictory."""

    items: tuple[int, ...] = STANDARD_LIST
    boresight: bool = False
    """Whether the heading of every station is set to zero at its present direction during configuration."""
    alignment: Alignment | Mapping[str, Alignment] | None = None
    """The frame to report in: one for all stations, or one for each station name. None leaves it unchanged."""
    keep_settings: bool = False
    """Whether the device keeps what other programs have set: tip offsets, alignments, boresight reference angles,
    filters and boresight. Otherwise they are at their defaults during the session. At its end they are put back, except
    boresight.
    """
    milliseconds: bool = True
    """Whether times on the wire are in milliseconds; False is microseconds. Frames are in seconds either way."""
    reach_m: float | None = None
    """Largest coordinate of any station in the tracker's frame [m], if known. A list of a shorter range is refused."""
    stylus_bytes: int = 1
    """Length of item 16, for a list that has it: 1 in both manuals, 2 in two programs (docs/is900.md 14)."""
    quality: Literal["record", "mp"] = "record"
    """Where lost stations show: "record" in items 40 and 76, "mp" in the replies to `MP`, polled once a second."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.quality not in ("record", "mp"):
            raise BadInput(f"Quality {self.quality!r} is not known.", "Use 'record' or 'mp'.")
        if self.quality == "record" and not set(QUALITY_ITEMS) & set(self.items):
            raise BadInput(
                f"The output list {join_commas(self.items)} has no item 40, so a lost station would not show.",
                "Add 40 to it, or use quality 'mp' (--quality mp).",
            )
        range_m = position_range_m(self.items)
        if range_m is not None and self.reach_m is not None and self.reach_m >= range_m:
            raise BadInput(
                f"The output list {join_commas(self.items)} carries positions up to {range_m:g} m from the tracker's "
                f"origin on each axis, but the stations reach {self.reach_m:.2f} m.",
                f"Use a list with item 2, such as --items {join_commas(STANDARD_LIST)} (the default). "
                "If the line is then too slow, use fewer stations or a lower rate.",
            )

    @property
    def settings(self) -> RecordFormat:
        """Number format that the device will be configured for."""
        return RecordFormat(self.metres_per_unit, 1e-3 if self.milliseconds else 1e-6, stylus_bytes=self.stylus_bytes)

    def alignment_of(self, station: str) -> Alignment | None:
        """Return the reporting frame of the station with this name, or None."""
        return self.alignment.get(station) if isinstance(self.alignment, Mapping) else self.alignment
