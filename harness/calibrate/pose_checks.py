"""What cannot be calibrated from: stations turned in the room, poses that were not held, stations exchanged."""

from itertools import combinations

import numpy as np

from harness.calibrate import station_orientation
from harness.calibrate.bundle_adjustment import Bundle, Expected
from harness.calibrate.bundle_fit import Fit, descended
from harness.calibrate.hold import NotStanding
from harness.calibrate.poses import POSES
from harness.calibrate.tpose_calibration import HEADING_SD_RAD, LEVEL
from harness.calibrate.unknowns import Solution
from harness.core import rotations
from harness.core.arrays import Floats

MOST_MISS_RAD = float(np.deg2rad(10.0))
"""A pose whose hinges are off by more than this on the whole is another pose: twice what people who try are off, and
half of what leaving out an arm or a leg makes [choice]."""
PECULIAR, PECULIAR_RAD = 2.0, float(np.deg2rad(5.0))
"""So is one that is off by so many times as much as most of them are, if by more than this [choice]."""
_LIKELIER, _LIKELY = 0.5, 2.0
"""Stations are called exchanged when the other way round leaves less than this share of the squared residuals, and not
many more in units of their spread than there are readings [choice]."""
_GLANCE, _LIKELIEST, _TRIED = 1, 4, 5
"""Each way round is looked at for a step, and the likeliest few for some more."""


def require_one_room(bundle: Bundle) -> None:
    """NotStanding when a station's orientations look turned in the room."""
    at = bundle.start()
    turn_rad = station_orientation.turned_in_room(
        bundle.reach(at).world_from_bone[:, bundle.shared.carriers], bundle.turn
    )
    turn_rad = rotations.rotate(rotations.inverse(LEVEL), turn_rad)
    found = np.flatnonzero(np.any(turn_rad != 0.0, axis=1))
    if len(found) == 0:
        return
    mounts = bundle.shared.mounts
    told = "; ".join(f"station {j + 1} ({mounts[j].station}) {station_orientation.about(turn_rad[j])}" for j in found)
    undo = ", ".join(f"b{j + 1}" for j in found)
    raise NotStanding(
        f"The same turn in every pose, in the tracker's axes (x forward, z down), is in what these report: {told}.",
        f"Undo the boresight (send {undo}) or the alignment (R) of these stations, or turn no orientation after "
        "reading it; then hold the poses again.",
    )


def require_poses(bundle: Bundle, found: Fit) -> None:
    """NotStanding when a pose was not held as shown: because stations are exchanged, or because it was another pose."""
    if found.heading_sd_rad > HEADING_SD_RAD:
        names = ", ".join(mount.station for mount in bundle.shared.mounts)
        raise NotStanding(
            f"Stations {names} do not tell which way the performer faces in the poses.",
            "Wear trackers on both sides of the body: a left and a right wrist, hand or ankle.",
        )
    worst = int(np.argmax(found.pose_miss_rad))
    usual = PECULIAR * float(np.median(found.pose_miss_rad))
    if found.pose_miss_rad[worst] <= min(MOST_MISS_RAD, max(usual, PECULIAR_RAD)):
        return
    _require_sides(bundle, found)
    mounts = bundle.shared.mounts
    off_m = _off_m(bundle, found)[worst]
    station = int(np.argmax(off_m))
    off_deg, off_mm = np.rad2deg(found.pose_miss_rad[worst]), 1e3 * off_m[station]
    raise NotStanding(
        f"Pose {worst + 1} ({POSES[worst].name}) was not held as shown: hinges are {off_deg:.0f} deg off on the whole; "
        f"station {mounts[station].station!r} is the farthest from its place in it, {off_mm:.0f} mm.",
        f"Hold it again: {POSES[worst].instruction}",
    )


def _off_m(bundle: Bundle, found: Fit) -> Floats:
    """(P, S) from where stations would be had the poses been held as shown, upright, to where they were."""
    at = found.solution
    start = bundle.start()
    asked = Solution(
        at.bone_m,
        at.weights_m,
        at.mount_m,
        at.bone_from_station,
        at.root_m,
        start.world_from_root,
        bundle.asked_rad,
    )
    place_m = bundle.reach(asked).place_m
    shift_m = np.median(bundle.place_m - place_m, axis=1, keepdims=True)
    return np.asarray(np.linalg.norm(bundle.place_m - place_m - shift_m, axis=2))


def _require_sides(bundle: Bundle, found: Fit) -> None:
    mounts = bundle.shared.mounts
    everyone = list(range(len(mounts)))
    bones = [mount.bone for mount in mounts]
    sides = [(bones.index(b), bones.index(f"r{b[1:]}")) for b in bones if b[0] == "l" and f"r{b[1:]}" in bones]
    given = Expected(MOST_MISS_RAD / 2.0, 1.0, found.expected.flesh_m, 0.005, np.deg2rad(1.0))
    plain = _Tried(bundle, everyone, given)
    tried = []
    for exchange in [*([pair] for pair in combinations(everyone, 2)), sides]:
        rows = list(everyone)
        for a, b in exchange:
            rows[a], rows[b] = b, a
        tried.append((_Tried(bundle, rows, given), exchange))
    tried = sorted(tried, key=lambda each: each[0].cost(_GLANCE))[:_LIKELIEST]
    best, which = min((each.cost(_TRIED), exchange) for each, exchange in tried)
    if best > min(_LIKELIER * plain.cost(_TRIED), _LIKELY * 6.0 * bundle.place_m[..., 0].size):
        return
    told = " and ".join(f"{mounts[a].station!r} with {mounts[b].station!r}" for a, b in which)
    raise NotStanding(
        f"Stations look exchanged: {told}.",
        "Check which tracker is worn where, or name the stations the other way round; then hold the poses again.",
    )


class _Tried:
    """A fit with the readings of these stations in the places of the others'."""

    def __init__(self, bundle: Bundle, rows: list[int], given: Expected) -> None:
        self._bundle = Bundle(bundle.shared, bundle.asked_rad, bundle.place_m[:, rows], bundle.turn[:, rows])
        self._at, self._damping, self._given = self._bundle.start(), 1e-3, given
        self._weight = np.ones((*bundle.place_m.shape[:2], 2))

    def cost(self, steps: int) -> float:
        """Squared residuals that are left after so many more steps."""
        for _ in range(steps):
            normal = self._bundle.normal(self._at, self._given, self._weight)
            self._at, self._damping, _ = descended(
                self._bundle, self._at, normal, self._given, self._weight, self._damping
            )
        return self._bundle.cost(self._at, self._given, self._weight)
