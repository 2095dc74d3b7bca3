"""Where a method loses: its difference to a better one, split over joints, phases of motion and states of readings.

Both methods answer the same true frames. The primary metric is the mean absolute error of the hinges, so the difference
of a frame is the sum of those of its joints, and the difference of a take is the mean over its frames. Shares therefore
add up to one over the joints, and over the phases of a joint. A share is a ratio of means over units (see `units`); its
interval is that of the ratio's linearisation (Cochran 1977, Sampling Techniques, 6.8).

A part is *named* if the other method loses more there than an even spread would: more than the joint's part of the
hinges, or more than the part of the time that a phase or a state takes. The sign-flip test over units
decides, corrected for all parts of one split, and the share must be relevant (`LEAST_SHARE`, `LEAST_EXCESS`).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.compare.paired_statistics import MIN_UNITS, mean_interval
from harness.compare.significance import SIGNIFICANCE, sign_flip_max_p, sign_flip_p
from harness.compare.units import Sampling
from harness.core.arrays import Bools, Floats, Ints
from harness.core.estimate import Status
from harness.core.humanoid24 import standard_skeleton, unpack
from harness.core.number_format import Interval
from harness.core.skeleton import local_rotation
from harness.results import Cell
from harness.score import hinged_bones, wrap_difference

_ARM_JOINTS = {"collarbones": "clavicle", "shoulders": "humerus", "elbows": "radius", "forearms": "wrist"}
_PAIRS = {**_ARM_JOINTS, "wrists": "hand", "hips": "femur", "knees": "tibia", "ankles": "foot"}
JOINTS: Mapping[str, tuple[str, ...]] = {
    **{"neck": ("lowerneck", "upperneck", "head"), "back": ("lowerback", "upperback", "thorax")},
    **{joint: (f"l{bone}", f"r{bone}") for joint, bone in _PAIRS.items()},
}
"""Joint -> the bones that its hinges turn, left before right; all hinged bones occur once."""
LEAST_SHARE, LEAST_EXCESS = 0.2, 1.5
"""Least share of a part that is named, and least ratio of it to that of an even spread [choice]."""
_SIDE_SHARE = 0.75
"""Least part of a pair's share by which one side is named alone [choice]."""
_POOR_QUALITY = 0.5
"""Quality below which a reading is called poor [choice]."""


@dataclass(frozen=True)
class DifferencePart:
    """One part of a difference: a joint, a phase of motion, or the frames with a station in a state."""

    name: str
    share: Interval
    """Share of the whole difference, of 1; without ends where there are fewer than `MIN_UNITS` units."""
    even_share: float
    """Share of an even spread over hinges or over time."""
    p: float = 1.0
    """Probability of a share at least as far from the even one, corrected for the number of parts."""

    @property
    def is_named(self) -> bool:
        """Whether the share is large, and significantly larger than that of an even spread."""
        least = max(LEAST_SHARE, LEAST_EXCESS * self.even_share)
        return self.share.value >= least and self.p <= SIGNIFICANCE


@dataclass(frozen=True)
class Decomposition:
    """The difference of two methods and its parts."""

    method: str
    """The method that loses."""
    reference: str
    units: tuple[str, ...]
    total_deg: Interval
    """Error of the method minus that of the reference, over units [deg]."""
    is_different: bool
    """Whether the total can be told from zero."""
    bones: Mapping[str, float]
    """Hinged bone -> its share."""
    joints: tuple[DifferencePart, ...]
    """In the order of `JOINTS`."""
    joint: str = ""
    """The joint whose phases are split: "left elbow", "elbows", or "" for the whole body."""
    phases: tuple[DifferencePart, ...] = ()
    """Ranges of the joint's angle, then thirds of the time by its speed; of the whole body by speed alone."""
    readings: tuple[DifferencePart, ...] = ()
    """States of the stations' readings that occur."""
    statuses: tuple[DifferencePart, ...] = ()
    """Statuses of the method that occur, but for SOLVED."""

    def largest(self, kind: str) -> DifferencePart | None:
        """The largest named part of "joints", "phases", "readings" or "statuses"; None if none is named."""
        chosen = [part for part in getattr(self, kind) if part.is_named]
        return max(chosen, key=lambda part: part.share.value, default=None)


def decompose_difference(
    method: str, reference: str, pairs: Iterable[tuple[Cell, Cell]], sampling: Sampling
) -> Decomposition | None:
    """Split the difference of `method` to `reference` over pairs (cell of `method`, cell of `reference`).

    Cells of a pair have the same clip and conditions. None if no pair has a frame that both answered, or if the method
    does not lose.
    """
    takes = [take for pair in pairs if len((take := _take(*pair)).loss_deg)]
    split = _Split(takes, sampling)
    total = split.by_unit([take.loss_deg.sum(axis=1) for take in takes])
    if not takes or total.mean() <= 0.0:
        return None
    bones = np.stack([split.by_unit([take.loss_deg[:, n] for take in takes]) for n in range(len(_BONES))], axis=1)
    columns = {name: [_BONES.index(bone) for bone in of] for name, of in JOINTS.items()}
    hinges = {name: np.full(len(total), sum(_HINGES[n] for n in of) / sum(_HINGES)) for name, of in columns.items()}
    whole = _interval(total, np.ones(len(total)), "deg")
    found = Decomposition(
        method,
        reference,
        split.units,
        whole,
        whole.low > 0.0 and sign_flip_p(total) <= SIGNIFICANCE,
        dict(zip(_BONES, (bones.mean(axis=0) / total.mean()).tolist(), strict=True)),
        _parts({name: (bones[:, of].sum(axis=1), hinges[name]) for name, of in columns.items()}, total, total),
        readings=_frames(split, [take.readings for take in takes], total),
        statuses=_frames(split, [take.statuses for take in takes], total),
    )
    joint = largest.name if (largest := found.largest("joints")) else ""
    at = columns.get(joint, list(range(len(_BONES))))
    if len(at) == 2 and (side := _side(bones[:, at])) is not None:
        at, joint = [at[side]], f"{('left', 'right')[side]} {joint.removesuffix('s')}"
    return replace(found, joint=joint, phases=_phases(split, at, joint, total))


_Losses = Mapping[str, tuple[Floats, Floats]]
"""Part -> its loss in each of U units (U,), and its share (U,) of hinges or of time."""
_SKELETON = standard_skeleton()
_BONES = [_SKELETON.names[bone] for bone in hinged_bones(_SKELETON)]
_HINGES = [len(_SKELETON.hinges[bone]) for bone in hinged_bones(_SKELETON)]


@dataclass(frozen=True, eq=False)
class _Take:
    """The N frames of a clip that both methods answered."""

    clip: str
    loss_deg: Floats
    """(N, 22) what each bone's hinges add to the difference of the primary metric."""
    angles_rad: Floats
    """(N, 48) true hinge angles."""
    per_s: Floats
    """(N,) one over the time since the frame before; 0 for the first one."""
    readings: Mapping[str, Bools]
    """State of a station's reading -> (N,)."""
    statuses: Mapping[str, Bools]
    """Status of the method -> (N,)."""

    def turned_deg(self, at: Sequence[int]) -> Floats:
        """(N, K) true rotation of bones from their rest pose."""
        return np.stack([_angle_deg(self._turn(n)) for n in at], axis=1)

    def speed_deg_s(self, at: Sequence[int]) -> Floats:
        """(N, K) true speed of that rotation."""
        turns = [np.swapaxes(np.roll(turn, 1, axis=0), -1, -2) @ turn for turn in map(self._turn, at)]
        return np.stack([_angle_deg(turn) for turn in turns], axis=1) * self.per_s[:, None]

    def _turn(self, n: int) -> Floats:
        return local_rotation(_SKELETON, int(hinged_bones(_SKELETON)[n]), self.angles_rad)


def _take(cell: Cell, reference: Cell) -> _Take:
    ours, theirs = (
        np.flatnonzero(mine.scores.scored & np.isin(mine.frame_index, other.frame_index[other.scores.scored]))
        for mine, other in ((cell, reference), (reference, cell))
    )
    per_s = cell.rate_hz / np.diff(cell.frame_index[ours], prepend=-np.inf)
    loss_deg = _joint_errors_deg(cell, ours) - _joint_errors_deg(reference, theirs)
    angles_rad, status = unpack(cell.truth_qpos[ours])[2], cell.status[ours]
    statuses = {"it holds a pose for lack of readings": status == Status.HELD, "it is lost": status == Status.LOST}
    return _Take(cell.clip, loss_deg, angles_rad, per_s, dict(_readings(cell, ours)), statuses)


def _angle_deg(turn: Floats) -> Floats:
    """Angle (...,) of rotation matrices (..., 3, 3), by the chord to the identity [deg]."""
    chord = np.sqrt(np.sum((turn - np.eye(3)) ** 2, axis=(-2, -1)))
    out: Floats = np.rad2deg(2.0 * np.arcsin(np.minimum(chord / np.sqrt(8.0), 1.0)))
    return out


def _joint_errors_deg(cell: Cell, rows: Ints) -> Floats:
    """(N, 22) absolute errors of the hinges of each bone, summed, over the number of all hinges."""
    truth, estimate = (unpack(qpos[rows])[2] for qpos in (cell.truth_qpos, cell.estimate_qpos))
    error = np.rad2deg(np.abs(wrap_difference(estimate - truth)))
    out: Floats = np.add.reduceat(error, np.cumsum([0, *_HINGES[:-1]]), axis=1) / error.shape[1]
    return out


def _readings(cell: Cell, rows: Ints) -> Iterable[tuple[str, Bools]]:
    """The states of readings by name; a part that a station never delivers is not missing."""
    for n, station in enumerate(cell.stations):
        valid = {"position": cell.position_valid[:, n], "orientation": cell.orientation_valid[:, n]}
        delivered = {part: of[rows] for part, of in valid.items() if of.any()}
        present = np.all([*delivered.values(), np.full(len(rows), bool(delivered))], axis=0)
        none = ~np.any([*delivered.values(), np.zeros(len(rows), bool)], axis=0)
        yield f"{station} has no reading", none
        for part, of in delivered.items():
            yield f"{station} lacks its {part} alone", ~of & ~none
        yield f"{station} has a reading in doubt", cell.suspect[rows, n] & present
        yield f"{station} has a reading of poor quality", (cell.quality[rows, n] < _POOR_QUALITY) & present


@dataclass(frozen=True, eq=False)
class _Split:
    """Takes and the units that they belong to."""

    takes: Sequence[_Take]
    sampling: Sampling

    @property
    def units(self) -> tuple[str, ...]:
        return tuple(sorted({self.sampling.unit_of(take.clip) for take in self.takes}))

    def by_unit(self, values: Sequence[Floats]) -> Floats:
        """(U,) means of a value (N,) of each take: over frames, then takes of a clip, then clips of a unit."""
        of_clip: dict[str, list[float]] = {}
        for take, value in zip(self.takes, values, strict=True):
            of_clip.setdefault(take.clip, []).append(float(value.mean()))
        of_unit: dict[str, list[float]] = {}
        for clip, means in of_clip.items():
            of_unit.setdefault(self.sampling.unit_of(clip), []).append(float(np.mean(means)))
        return np.array([np.mean(of_unit[unit]) for unit in self.units])

    def part(self, losses: Sequence[Floats], inside: Sequence[Bools]) -> tuple[Floats, Floats]:
        """(U,) loss inside some frames (N, K) of each take, and (U,) share of the time that they take."""
        lost = self.by_unit([(loss * frames).sum(axis=1) for loss, frames in zip(losses, inside, strict=True)])
        return lost, self.by_unit([frames.mean(axis=1) for frames in inside])


def _phases(split: _Split, at: Sequence[int], joint: str, total: Floats) -> tuple[DifferencePart, ...]:
    """Ranges of angle and thirds of speed. Each of two sides has its own; the bones of a chain add up."""

    def add_chain(values: Floats) -> Floats:
        out: Floats = values if joint and len(at) <= 2 else values.sum(axis=1, keepdims=True)
        return out

    losses = [add_chain(take.loss_deg[:, at]) for take in split.takes]
    speeds = [add_chain(take.speed_deg_s(at)) / (1 if joint else len(at)) for take in split.takes]
    subject = f"the {_SUBJECTS.get(joint.split()[-1].rstrip('s'), joint)}" if joint else "the mean joint"
    found = _ranges(split, losses, speeds, lambda low, high: _speed_words(subject, low, high))
    if joint:
        limits = _BENT_DEG if subject[4:] in _SUBJECTS.values() else None
        angles = [add_chain(take.turned_deg(at)) for take in split.takes]
        found = _ranges(split, losses, angles, lambda low, high: _angle_words(subject, low, high), limits) | found
    return _parts(found, split.by_unit([loss.sum(axis=1) for loss in losses]), total)


_SUBJECTS = {"elbow": "arm", "knee": "leg"}
"""What is straight or bent at a joint."""
_BENT_DEG = (30.0, 90.0)
"""Angles from which on arm and leg are called bent, and strongly bent [choice]."""


def _angle_words(subject: str, low: float | None, high: float | None) -> str:
    if subject[4:] not in _SUBJECTS.values():
        return f"{subject} {_be(subject)} {_range(low, high, '°')} from the rest pose"
    how = "is straight" if low is None else "is bent" if high else "is strongly bent"
    return f"{subject} {how} ({_range(low, high, '°')})"


def _speed_words(subject: str, low: float | None, high: float | None) -> str:
    return f"{subject} {'turn' if _be(subject) == 'are' else 'turns'} by {_range(low, high, '°/s')}"


def _be(subject: str) -> str:
    return "are" if subject.endswith("s") else "is"


def _range(low: float | None, high: float | None, unit: str) -> str:
    if low is None:
        return f"less than {high:.0f}{unit}"
    return f"more than {low:.0f}{unit}" if high is None else f"{low:.0f} to {high:.0f}{unit}"


def _ranges(
    split: _Split,
    losses: Sequence[Floats],
    values: Sequence[Floats],
    words: Callable[[float | None, float | None], str],
    limits: tuple[float, float] | None = None,
) -> dict[str, tuple[Floats, Floats]]:
    """Three ranges of a value (N, K) of each take: between limits, or by default thirds of the time."""
    one, two = limits or np.quantile(np.concatenate([value.ravel() for value in values]), (1 / 3, 2 / 3))
    inside = {
        words(None, one): [value <= one for value in values],
        words(one, two): [(value > one) & (value <= two) for value in values],
        words(two, None): [value > two for value in values],
    }
    return {name: split.part(losses, rows) for name, rows in inside.items() if any(row.any() for row in rows)}


def _frames(split: _Split, states: Sequence[Mapping[str, Bools]], total: Floats) -> tuple[DifferencePart, ...]:
    """The states of each take that occur in some."""
    losses = [take.loss_deg.sum(axis=1, keepdims=True) for take in split.takes]
    names = dict.fromkeys(name for of_take in states for name, rows in of_take.items() if rows.any())
    none = [np.zeros(len(loss), dtype=bool) for loss in losses]
    rows = {name: [of.get(name, no)[:, None] for of, no in zip(states, none, strict=True)] for name in names}
    return _parts({name: split.part(losses, inside) for name, inside in rows.items()}, total, total)


def _parts(losses: _Losses, whole: Floats, total: Floats) -> tuple[DifferencePart, ...]:
    """Parts of `whole` (U,) as shares of `total` (U,), tested together against an even spread."""
    excess = {name: lost - even * whole for name, (lost, even) in losses.items()}
    enough = bool(excess) and len(total) >= MIN_UNITS
    p = dict(zip(excess, sign_flip_max_p(list(excess.values())), strict=True)) if enough else {}
    return tuple(
        DifferencePart(name, _interval(lost, total), float((even * whole).mean() / total.mean()), p.get(name, 1.0))
        for name, (lost, even) in losses.items()
    )


def _interval(values: Floats, over: Floats, unit: str = "") -> Interval:
    """The ratio of the means of (U,) values, with its interval from `MIN_UNITS` units on."""
    ratio = float(values.mean() / over.mean())
    if len(values) < MIN_UNITS:
        return Interval(ratio, unit=unit)
    low, high = mean_interval(ratio + (values - ratio * over) / over.mean())
    return Interval.of(ratio, low, high, unit)


def _side(losses: Floats) -> int | None:
    """The side that holds a pair's losses (U, 2) alone, 0 for left; None if it is not one side."""
    share = losses.mean(axis=0) / losses.mean() / 2.0
    side = int(np.argmax(share))
    return side if share[side] >= _SIDE_SHARE and sign_flip_p(losses[:, 0] - losses[:, 1]) <= SIGNIFICANCE else None
