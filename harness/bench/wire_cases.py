"""The serial and TCP lines that `harness bench wire` measures, and the motion that is sent."""

from dataclasses import dataclass

from harness.stream.codec.items import SHORT_LIST, STANDARD_LIST, describe_list

SCENARIO, CLIP = "demo", "boxing_p1_01"


@dataclass(frozen=True)
class WireCase:
    """Number of stations and rate on one kind of line."""

    stations: int
    rate_hz: float
    items: tuple[int, ...]
    kind: str
    """"pty" or "tcp"; a pty is paced at 115200 baud, TCP is not."""

    @property
    def name(self) -> str:
        """The name in the table."""
        line = "pty at 115200" if self.kind == "pty" else "TCP, unpaced"
        return f"{self.rate_hz:g} Hz x {self.stations}, {describe_list(self.items)}, {line}"


CASES = (
    WireCase(4, 75.0, STANDARD_LIST, "pty"),
    WireCase(6, 50.0, STANDARD_LIST, "pty"),
    WireCase(4, 120.0, SHORT_LIST, "pty"),
    WireCase(4, 120.0, STANDARD_LIST, "tcp"),
)
