"""Checks of an eight-pose calibration: rotated orientation outputs, poses not held, exchanged stations."""

from itertools import combinations

import numpy as np

from harness.calibrate import station_orientation
from harness.calibrate.bundle_adjustment import BundleAdjustment, ResidualScales
from harness.calibrate.bundle_fit import BundleFit, levenberg_marquardt_step
from harness.calibrate.hold import UnusableHold
from harness.calibrate.poses import POSES
from harness.calibrate.tpose_calibration import HEADING_SD_RAD, LEVEL_FROM_TRACKER
from harness.calibrate.unknowns import CalibrationSolution
from harness.core import rotations
from harness.core.arrays import Floats

MOST_POSE_ERROR_RAD = float(np.deg2rad(10.0))
"""Largest error of a pose's hinges, RMS [rad]: twice that of people who try, half that of a missing arm or leg
[choice]."""
OUTLIER_RATIO, OUTLIER_RAD = 2.0, float(np.deg2rad(5.0))
"""A pose is also refused if its error exceeds the median pose's by this ratio and exceeds this angle [choice]."""
_COST_RATIO, _COST_PER_READING = 0.5, 2.0
"""Stations are reported as exchanged when exchanging them leaves less than this share of the cost, and at most this
much cost per reading [choice]."""
_SCREENING_STEPS, _CANDIDATES, _FINAL_STEPS = 1, 4, 5
"""Every exchange is screened with one step; the best candidates get more."""


def require_no_boresight(bundle: BundleAdjustment) -> None:
    """UnusableHold when a station's orientations look rotated by a boresight or an alignment."""
    at = bundle.start()
    turn_rad = station_orientation.estimate_boresight_rad(
        bundle.forward_kinematics(at).world_from_bone[:, bundle.shared.carriers], bundle.turn
    )
    turn_rad = rotations.rotate(rotations.inverse(LEVEL_FROM_TRACKER), turn_rad)
    rotated_stations = np.flatnonzero(np.any(turn_rad != 0.0, axis=1))
    if len(rotated_stations) == 0:
        return
    mounts = bundle.shared.mounts
    rotated = "; ".join(
        f"station {j + 1} ({mounts[j].station}) {station_orientation.rotation_text(turn_rad[j])}"
        for j in rotated_stations
    )
    undo = ", ".join(f"b{j + 1}" for j in rotated_stations)
    raise UnusableHold(
        f"These stations report orientations with the same rotation in every pose (axes x forward, z down): {rotated}.",
        f"Undo the boresight (send {undo}) or the alignment (R) of these stations, or remove any rotation that is "
        "applied after reading; then hold the poses again.",
    )


def require_poses_held(bundle: BundleAdjustment, fit: BundleFit) -> None:
    """UnusableHold when a pose was not held as shown, or when stations are exchanged."""
    if fit.heading_sd_rad > HEADING_SD_RAD:
        names = ", ".join(mount.station for mount in bundle.shared.mounts)
        raise UnusableHold(
            f"Stations {names} do not determine which way the performer faces.",
            "Wear trackers on both sides of the body: a left and a right wrist, hand or ankle.",
        )
    worst = int(np.argmax(fit.pose_error_rad))
    usual = OUTLIER_RATIO * float(np.median(fit.pose_error_rad))
    if fit.pose_error_rad[worst] <= min(MOST_POSE_ERROR_RAD, max(usual, OUTLIER_RAD)):
        return
    _require_no_exchange(bundle, fit)
    mounts = bundle.shared.mounts
    off_m = pose_distances_m(bundle, fit)[worst]
    station = int(np.argmax(off_m))
    off_deg, off_mm = np.rad2deg(fit.pose_error_rad[worst]), 1e3 * off_m[station]
    raise UnusableHold(
        f"Pose {worst + 1} ({POSES[worst].name}) was not held as shown: hinges are {off_deg:.0f} deg off (RMS); "
        f"station {mounts[station].station!r} is the farthest from its place in it, {off_mm:.0f} mm.",
        f"Hold it again: {POSES[worst].instruction}",
    )


def pose_distances_m(bundle: BundleAdjustment, fit: BundleFit) -> Floats:
    """(P, S) distance of stations from where they would be had the poses been held as shown, upright [m]."""
    at = fit.solution
    start = bundle.start()
    as_shown = CalibrationSolution(
        at.bone_m,
        at.weights_m,
        at.mount_m,
        at.bone_from_station,
        at.root_m,
        start.world_from_root,
        bundle.nominal_rad,
    )
    place_m = bundle.forward_kinematics(as_shown).place_m
    shift_m = np.median(bundle.place_m - place_m, axis=1, keepdims=True)
    return np.asarray(np.linalg.norm(bundle.place_m - place_m - shift_m, axis=2))


def _require_no_exchange(bundle: BundleAdjustment, fit: BundleFit) -> None:
    mounts = bundle.shared.mounts
    """UnusableHold when exchanging two stations, or all left and right ones, fits far better."""
    stations = list(range(len(mounts)))
    bones = [mount.bone for mount in mounts]
    sides = [(bones.index(b), bones.index(f"r{b[1:]}")) for b in bones if b[0] == "l" and f"r{b[1:]}" in bones]
    scales = ResidualScales(MOST_POSE_ERROR_RAD / 2.0, 1.0, fit.scales.skin_offset_m, 0.005, np.deg2rad(1.0))
    plain = _ExchangedFit(bundle, stations, scales)
    candidates = []
    for exchange in [*([pair] for pair in combinations(stations, 2)), sides]:
        rows = list(stations)
        for a, b in exchange:
            rows[a], rows[b] = b, a
        candidates.append((_ExchangedFit(bundle, rows, scales), exchange))
    candidates = sorted(candidates, key=lambda each: each[0].cost(_SCREENING_STEPS))[:_CANDIDATES]
    best, which = min((each.cost(_FINAL_STEPS), exchange) for each, exchange in candidates)
    if best > min(_COST_RATIO * plain.cost(_FINAL_STEPS), _COST_PER_READING * 6.0 * bundle.place_m[..., 0].size):
        return
    pairs = " and ".join(f"{mounts[a].station!r} with {mounts[b].station!r}" for a, b in which)
    raise UnusableHold(
        f"Stations look exchanged: {pairs}.",
        "Check which tracker is worn where, or name the stations the other way round; then hold the poses again.",
    )


class _ExchangedFit:
    """A fit with the stations' readings in another order."""

    def __init__(self, bundle: BundleAdjustment, rows: list[int], scales: ResidualScales) -> None:
        self._bundle = BundleAdjustment(
            bundle.shared, bundle.nominal_rad, bundle.place_m[:, rows], bundle.turn[:, rows]
        )
        self._at, self._damping, self._given = self._bundle.start(), 1e-3, scales
        self._weight = np.ones((*bundle.place_m.shape[:2], 2))

    def cost(self, steps: int) -> float:
        """The cost after a number of further steps."""
        for _ in range(steps):
            normal = self._bundle.normal_equations(self._at, self._given, self._weight)
            self._at, self._damping, _ = levenberg_marquardt_step(
                self._bundle, self._at, normal, self._given, self._weight, self._damping
            )
        return self._bundle.cost(self._at, self._given, self._weight)
