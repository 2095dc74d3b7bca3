"""The report of an inspection: facts and findings about a motion file, for JSON and for a terminal."""

from dataclasses import asdict, dataclass
from typing import Any

from harness.mocap.motion_checks import Spike, SuddenTurn

MAX_LISTED = 8
"""Number of spikes, and of turns, that are listed; the others are counted."""


@dataclass(frozen=True)
class Inspection:
    """Facts about a motion with their evidence, and findings to check before the motion is used."""

    name: str
    format: str
    """`amc`, `bvh`, `mvnx`, `npz`, `c3d` or `clip` (in memory)."""
    frames: int
    rate_hz: float
    rate_evidence: str
    height_m: float | None
    """Height of the skeleton from sole to top joint [m]; None where the file holds no bones."""
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
    """Highest speed of any joint [m/s]; the next two fields name the joint and the frame, counted from 1."""
    fastest_joint: str
    fastest_frame: int
    spikes: tuple[Spike, ...]
    turns: tuple[SuddenTurn, ...]
    """Turns of a hand or foot by 30 deg and more in a single frame; empty where there are no bones."""
    frozen: tuple[tuple[int, int], ...]
    """First and last frame of each run of equal frames, counted from 1."""
    missing_share: float
    """Share of marker positions that are missing; 0 for skeletons."""
    missing_markers: tuple[str, ...]
    """Markers with missing positions."""
    limits_share: float | None
    """Share of frames with a hinge outside the model's limits; None where there are no hinges."""
    limits_worst: str
    """The hinge that exceeds its limits most, and by how much."""
    doubts: tuple[str, ...]
    """Evidence against the unit or the axes."""
    notes: tuple[str, ...]

    @property
    def duration_s(self) -> float:
        return (self.frames - 1) / self.rate_hz

    @property
    def findings(self) -> tuple[str, ...]:
        """Problems of the motion, each in a sentence; empty if there are none."""
        findings = [f"frame {s.frame}: {s.joint} is off by {s.speed_m_s:.1f} m/s" for s in self.spikes[:MAX_LISTED]]
        if len(self.spikes) > MAX_LISTED:
            findings.append(f"and {len(self.spikes) - MAX_LISTED} more frames with spikes")
        findings += [f"frame {t.frame}: {t.bone} turns by {t.turn_deg:.0f} deg" for t in self.turns[:MAX_LISTED]]
        if len(self.turns) > MAX_LISTED:
            findings.append(f"and {len(self.turns) - MAX_LISTED} more turns of hands and feet")
        findings += [f"frames {first} to {last} are all the same" for first, last in self.frozen]
        if self.missing_share > 0.0:
            labels = ", ".join(self.missing_markers[:MAX_LISTED])
            findings.append(f"{100 * self.missing_share:.2g} % of the marker positions are missing ({labels})")
        if self.limits_share:
            findings.append(f"{100 * self.limits_share:.1f} % of the frames break a joint limit ({self.limits_worst})")
        return (*findings, *self.doubts)

    def as_dict(self) -> dict[str, Any]:
        """All fields, duration and findings, for JSON."""
        return asdict(self) | {"duration_s": self.duration_s, "findings": list(self.findings)}

    def lines(self) -> list[str]:
        """The report as lines of text for a terminal."""
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
        lines = [f"{key:<9} {value}" for key, value in facts.items()]
        lines += [f"{'note':<9} {note}" for note in self.notes]
        lines += [f"{'finding':<9} {finding}" for finding in self.findings] or [f"{'finding':<9} none"]
        return lines
