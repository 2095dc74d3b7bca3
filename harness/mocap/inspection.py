"""What a motion file is found to be, and how that is told."""

from dataclasses import asdict, dataclass
from typing import Any

from harness.mocap.motion_checks import Spike

MAX_LISTED_SPIKES = 8
"""So many spikes are spelled out; the rest are counted."""


@dataclass(frozen=True)
class Inspection:
    """Facts with their evidence, and findings: what should be looked at before the motion is used."""

    name: str
    format: str
    """`amc`, `bvh`, `npz`, `c3d` or `clip` (in memory)."""
    frames: int
    rate_hz: float
    rate_evidence: str
    height_m: float | None
    """Of the skeleton, sole to top joint [m]; None where the file holds no bones."""
    up: str
    """The file's axis that points up, with the evidence."""
    unit_m: float
    """Length of 1 in the file [m]."""
    unit_evidence: str
    floor_m: float
    """Height of the floor above z = 0 [m]."""
    contact_share: float
    """Share of frames with a foot on the floor."""
    fastest_m_s: float
    fastest_joint: str
    fastest_frame: int
    spikes: tuple[Spike, ...]
    frozen: tuple[tuple[int, int], ...]
    """First and last frame of each run of equal frames, counted from 1."""
    missing_share: float
    """Share of marker positions that were not seen; 0 for skeletons."""
    missing_markers: tuple[str, ...]
    """Markers of which positions are missing."""
    limits_share: float | None
    """Share of frames with a hinge outside the model's limits; None where there are no hinges."""
    limits_worst: str
    """The hinge that is furthest outside, and by how much."""
    doubts: tuple[str, ...]
    """What the numbers say against the unit or the axes."""
    notes: tuple[str, ...]

    @property
    def duration_s(self) -> float:
        return (self.frames - 1) / self.rate_hz

    @property
    def findings(self) -> tuple[str, ...]:
        """What is wrong, in words; () is a clean bill."""
        found = [f"frame {s.frame}: {s.joint} is off by {s.speed_m_s:.1f} m/s" for s in self.spikes[:MAX_LISTED_SPIKES]]
        if len(self.spikes) > MAX_LISTED_SPIKES:
            found.append(f"and {len(self.spikes) - MAX_LISTED_SPIKES} more frames with spikes")
        found += [f"frames {first} to {last} are all the same" for first, last in self.frozen]
        if self.missing_share > 0.0:
            labels = ", ".join(self.missing_markers[:MAX_LISTED_SPIKES])
            found.append(f"{100 * self.missing_share:.2g} % of the marker positions are missing ({labels})")
        if self.limits_share:
            found.append(f"{100 * self.limits_share:.1f} % of the frames break a joint limit ({self.limits_worst})")
        return (*found, *self.doubts)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self) | {"duration_s": self.duration_s, "findings": list(self.findings)}

    def lines(self) -> list[str]:
        """For a terminal."""
        height = "not in the file" if self.height_m is None else f"{self.height_m:.2f} m (from its bones)"
        outside = "not checked, there are no hinges"
        if self.limits_share is not None:
            outside = f"{100 * self.limits_share:.1f} % of the frames outside"
        facts = {
            "file": f"{self.name} ({self.format})",
            "frames": f"{self.frames} at {self.rate_hz:g} Hz ({self.rate_evidence}), {self.duration_s:.2f} s",
            "height": height,
            "up": self.up,
            "unit": f"{self.unit_m:.6g} m ({self.unit_evidence})",
            "floor": f"z = {self.floor_m:+.3f} m, a foot on it in {100 * self.contact_share:.0f} % of the frames",
            "fastest": f"{self.fastest_joint}, {self.fastest_m_s:.1f} m/s at frame {self.fastest_frame}",
            "limits": outside,
        }
        told = [f"{key:<9} {value}" for key, value in facts.items()]
        told += [f"{'note':<9} {note}" for note in self.notes]
        told += [f"{'finding':<9} {finding}" for finding in self.findings] or [f"{'finding':<9} none"]
        return told
