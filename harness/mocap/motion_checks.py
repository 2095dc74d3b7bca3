"""Checks of recorded motion, and their report: facts and findings about a motion file, for JSON and for a terminal.

Spikes, sudden turns of hands and feet, frozen frames and broken joint limits are sought. The thresholds were chosen on
163 AMC clips of CMU's library at 120 frames per second. They find the five clips with known glitches (05_13, 16_01,
16_15, 16_23, 16_28), and three more. In 13_17 the right shoulder jumps by 0.14 m at frame 716 and stays there. In 16_17
the whole body is 0.09 m off in frame 475 only. 49_04 has runs of identical frames. The largest jump in any other clip
is 11.2 m/s, the largest twitch 16.0 m/s. Hands and feet turn suddenly in 27 clips.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, Ints, find_runs
from harness.core.humanoid24 import has_bones, limits_rad, select_bones, standard_skeleton
from harness.core.rotations import wrap_angle
from harness.core.skeleton import Skeleton, equivalent_euler_angles, local_rotation

JUMP_M_S = 12.0
"""Largest difference of a joint's velocity from the median of the two frames before and after [m/s]."""
TWITCH_M_S = 18.0
"""Largest change of a joint's velocity from one frame to the next [m/s]."""
FROZEN_TOLERANCE_M = 1e-7
"""Two frames are equal if no joint moves farther [m]; in recorded motion some joint always does."""
FROZEN_FRAMES = 3
"""Least number of equal frames in a row that count as frozen."""
TURN_RAD, TURN_RATE_HZ = np.deg2rad(30.0), 120.0
"""Least turn of a hand or foot from one frame to the next, at rates up to this; a slower file's frames allow more."""
TURNING_BONES = ("lwrist", "lhand", "lfoot", "rwrist", "rhand", "rfoot")
"""Bones whose turns are checked: few markers carry them. The wrist is the forearm's rotation about its length."""
CONTACT_M = 0.05
"""A foot is on the floor if its lowest point is within this distance of it [m]."""


@dataclass(frozen=True)
class Spike:
    """A joint that moves faster than a body can."""

    frame: int
    """Frame after the jump, or the single wrong frame, counted from 1 as in AMC files."""
    joint: str
    speed_m_s: float
    """Excess of its speed [m/s]."""


def find_spikes(names: tuple[str, ...], position_m: Floats, rate_hz: float) -> tuple[Spike, ...]:
    """The worst joint in each run of frames with a jump or a twitch, for positions (T, P, 3) [m]; NaN is ignored."""
    if len(position_m) < 3:
        return ()
    step = np.diff(position_m, axis=0) * rate_hz
    around = np.pad(step, ((2, 2), (0, 0), (0, 0)), mode="edge")
    middle = np.median(np.stack([around[:-4], around[1:-3], around[3:-1], around[4:]]), axis=0)
    jump = np.nan_to_num(_norm(step - middle))
    twitch = np.zeros_like(jump)
    twitch[:-1] = np.nan_to_num(_norm(np.diff(step, axis=0)))
    excess = np.maximum(jump / JUMP_M_S, twitch / TWITCH_M_S)
    spikes = []
    for first, end in find_runs(excess.max(axis=1) > 1.0):
        t = int(first + jump[first:end].max(axis=1).argmax())
        joint = int(excess[t].argmax())
        spikes.append(Spike(t + 2, names[joint], float(max(jump[t, joint], twitch[t, joint]))))
    return tuple(spikes)


@dataclass(frozen=True)
class SuddenTurn:
    """A hand or foot that turns farther in one frame than a body can."""

    frame: int
    """Frame after the turn, counted from 1."""
    bone: str
    turn_deg: float
    """Geodesic angle between its rotations relative to the parent bone, in this frame and the one before [deg]."""


def find_turns(skeleton: Skeleton, angles_rad: Floats, rate_hz: float) -> tuple[SuddenTurn, ...]:
    """Every step of at least TURN_RAD of each of TURNING_BONES that the skeleton has, in the order of frames.

    Below TURN_RATE_HZ the least turn is that of the same angular velocity, 3600 deg/s.
    """
    least_deg = np.rad2deg(TURN_RAD) * max(1.0, TURN_RATE_HZ / rate_hz)
    turns = []
    for bone in TURNING_BONES:
        if bone in skeleton.names:
            local = rotations.from_matrix(local_rotation(skeleton, skeleton.index(bone), angles_rad))
            turn_deg = np.rad2deg(rotations.angle_between_rad(local[1:], local[:-1]))
            turns += [SuddenTurn(int(t) + 2, bone, float(turn_deg[t])) for t in np.flatnonzero(turn_deg >= least_deg)]
    return tuple(sorted(turns, key=lambda turn: turn.frame))


def find_frozen_frames(position_m: Floats) -> tuple[tuple[int, int], ...]:
    """First and last frame, counted from 1, of each run of at least FROZEN_FRAMES equal frames."""
    still = np.nan_to_num(_norm(np.diff(position_m, axis=0))).max(axis=1, initial=0.0) < FROZEN_TOLERANCE_M
    return tuple((int(first) + 1, int(end) + 1) for first, end in find_runs(still) if end + 1 - first >= FROZEN_FRAMES)


def estimate_floor(position_m: Floats, feet: Ints) -> tuple[float, float]:
    """Height of the floor (2nd percentile of the lowest foot point) [m], and the share of frames with a foot on it."""
    lowest = np.nan_to_num(position_m[:, feet, 2], nan=np.inf).min(axis=1)
    height = float(np.percentile(lowest[np.isfinite(lowest)], 2.0))
    return height, float(np.mean(lowest < height + CONTACT_M))


def find_fastest_joint(names: tuple[str, ...], position_m: Floats, rate_hz: float) -> tuple[float, str, int]:
    """Highest speed of any joint [m/s], that joint, and the frame in which it is reached, counted from 1."""
    speed = np.nan_to_num(_norm(np.diff(position_m, axis=0))) * rate_hz
    if speed.size == 0:
        return 0.0, names[0], 1
    frame, joint = np.unravel_index(int(speed.argmax()), speed.shape)
    return float(speed[frame, joint]), names[int(joint)], int(frame) + 2


def has_standard_hinges(skeleton: Skeleton) -> bool:
    """Whether the skeleton has the 24 bones with the standard hinges, so that the model's limits apply."""
    return has_bones(skeleton) and select_bones(skeleton)[0].dof_names == standard_skeleton().dof_names


def measure_limit_violations(skeleton: Skeleton, angles_rad: Floats) -> tuple[float, float, str]:
    """Share of frames with a hinge outside the model's limits, the largest excess [rad], and its hinge.

    The limits are those of `core.humanoid24` and hold for principal angles; `has_standard_hinges` must be true.
    """
    body, dofs = select_bones(skeleton)
    angles = principal_angles(body, angles_rad[:, dofs])
    limits = limits_rad()
    excess = np.maximum(limits[:, 0] - angles, angles - limits[:, 1])
    most = excess.max(axis=0)
    share = float(np.mean(excess.max(axis=1) > 1e-9))
    return share, float(most.max()), body.dof_names[int(most.argmax())]


def principal_angles(skeleton: Skeleton, angles_rad: Floats) -> Floats:
    """Angles (T, D) of the same rotations, in [-pi, pi), with the middle one of three in [-pi/2, pi/2] [rad]."""
    out = wrap_angle(np.array(angles_rad, dtype=float))
    for dofs in skeleton.dof_of_bone:
        if dofs.stop - dofs.start == 3:
            over = np.abs(out[:, dofs.start + 1]) > 0.5 * np.pi
            out[over, dofs] = wrap_angle(equivalent_euler_angles(out[over, dofs]))
    return out


def _norm(vectors: Floats) -> Floats:
    out: Floats = np.sqrt(np.sum(vectors**2, axis=-1))
    return out


MAX_LISTED = 8
"""Number of spikes, and of turns, that are listed; the others are counted."""


@dataclass(frozen=True, kw_only=True)
class Inspection:
    """Facts about a motion with their evidence, and findings to check before the motion is used."""

    name: str
    format: str = "clip"
    """`amc`, `bvh`, `mvnx`, `npz`, `c3d` or `clip` (in memory)."""
    frames: int
    rate_hz: float
    rate_evidence: str = "of the clip"
    height_m: float | None = None
    """Height of the skeleton from sole to top joint [m]; None where the file holds no bones."""
    up: str
    """The file's axis that points up, with the evidence."""
    unit_m: float = 1.0
    """Length of 1 in the file [m]."""
    unit_evidence: str = "metres"
    floor_m: float
    """Height of the floor above z = 0 [m]."""
    contact_share: float
    """Share of frames with a foot on the floor."""
    fastest_m_s: float
    """Highest speed of any joint [m/s]; the next two fields name the joint and the frame, counted from 1."""
    fastest_joint: str
    fastest_frame: int
    spikes: tuple[Spike, ...]
    turns: tuple[SuddenTurn, ...] = ()
    """Turns of a hand or foot by 30 deg and more in a single frame; empty where there are no bones."""
    frozen: tuple[tuple[int, int], ...]
    """First and last frame of each run of equal frames, counted from 1."""
    missing_share: float = 0.0
    """Share of marker positions that are missing; 0 for skeletons."""
    missing_markers: tuple[str, ...] = ()
    """Markers with missing positions."""
    limits_share: float | None = None
    """Share of frames with a hinge outside the model's limits; None where there are no hinges."""
    limits_worst: str = ""
    """The hinge that exceeds its limits most, and by how much."""
    doubts: tuple[str, ...]
    """Evidence against the unit or the axes."""
    notes: tuple[str, ...] = ()

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
