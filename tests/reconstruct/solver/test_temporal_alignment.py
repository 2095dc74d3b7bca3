"""Readings at one instant: planted motions, what ends a history, and what noise becomes."""

from dataclasses import replace

import numpy as np
import pytest

from harness.body import DEFAULT_MOUNTS
from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.reconstruct import registry
from harness.reconstruct.solver.frame_reader import SessionReader
from harness.reconstruct.solver.outlier_gate import OutlierGate
from harness.reconstruct.solver.reading_prediction import unlearnt_moments
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.temporal_alignment import MAX_BEND_M, MAX_STEP_S, MAX_TURN_RAD
from harness.simulate import Noise, TrackerConfig, simulate_tracker
from harness.stream import TrackerFrame
from harness.testing.frames import drop_stations
from tests.joint_centres import joint_centres_m
from tests.reconstruct.conftest import Scene

PERIOD_S = 0.025
SLOT_S = np.array([-0.0082, -0.0049, -0.0016, 0.0016, 0.0049, 0.0082])
"""(6,) sampling times about the mean."""
BEFORE, AFTER = SLOT_S < 0.0, SLOT_S > 0.0
EVERY = np.ones(6, bool)


class Motion:
    """Positions that are a polynomial of time, and orientations that turn at a constant rate, for six stations."""

    def __init__(self, rng: np.random.Generator, degree: int) -> None:
        self.coefficients = rng.normal(0.0, 1.0, (degree + 1, 6, 3))
        self.start, self.rate_rad_s = rotations.exp(rng.normal(size=(6, 3))), rng.normal(0.0, 3.0, (6, 3))

    def frame(self, at_s: Floats) -> TrackerFrame:
        """The readings at times (6,) of the stations [s]."""
        position_m = sum(c * at_s[:, None] ** power for power, c in enumerate(self.coefficients))
        turn = rotations.multiply(rotations.exp(self.rate_rad_s * at_s[:, None]), self.start)
        return TrackerFrame(float(at_s.max()), at_s, np.asarray(position_m), turn, EVERY, EVERY, EVERY * 1.0, ~EVERY)

    def frames(self, count: int) -> list[TrackerFrame]:
        """The readings of the stations in turn."""
        return [self.frame(7.0 + PERIOD_S * index + SLOT_S) for index in range(count)]

    def at_one_instant(self, index: int) -> TrackerFrame:
        """What `frames` would have with all stations sampled at the frame's instant."""
        return self.frame(np.full(6, 7.0 + PERIOD_S * index))


def read(walk: Scene, frame: TrackerFrame) -> tuple[Floats, Floats]:
    """Targets (S, 3), (S, 4) of a frame as measured."""
    residuals = Residuals(walk.body, walk.calibration, Loss())
    residuals.read(frame)
    return residuals.target_m, residuals.world_from_target


class ChosenOutliers(OutlierGate):
    """Leaves out the rows that it is told to, and keeps the sampling times that it is given."""

    def __init__(self, rows: dict[int, list[int]]) -> None:
        super().__init__(6, np.inf)
        self.rows, self.offsets_s = rows, list[Floats]()

    def read(self, frame: TrackerFrame, residuals: Residuals, offset_s: Floats | None = None) -> None:
        super().read(frame, residuals, offset_s)
        rows = np.isin(np.arange(12), self.rows.get(len(self.offsets_s), []))
        residuals.leave_out(rows)
        assert offset_s is not None
        self.offsets_s.append(offset_s.copy())


def align(
    walk: Scene, frames: list[TrackerFrame], left_out: dict[int, list[int]] | None = None
) -> list[tuple[Floats, Floats]]:
    """Aligned targets of each frame, without those predicted: as read instead. `left_out`: stations by frame."""
    reader = reader_of(walk, ChosenOutliers(left_out or {}))
    out, residuals = [], reader.residuals
    for frame in frames:
        reader.read(frame)
        places, turns = ~residuals.fresh.reshape(2, -1, 1)
        at_m, turned = read(walk, frame)
        aligned: tuple[Floats, Floats] = (
            np.where(places, at_m, residuals.target_m),
            np.where(turns, turned, residuals.world_from_target),
        )
        out.append(aligned)
    return out


def reader_of(walk: Scene, gate: OutlierGate) -> SessionReader:
    """A reader that aligns, with this gate."""
    reader = SessionReader(Residuals(walk.body, walk.calibration, Loss()), unlearnt_moments(6), align=True)
    reader.gate = gate
    return reader


def moved(walk: Scene, frames: list[TrackerFrame], left_out: dict[int, list[int]] | None = None) -> Bools:
    """(F, S) which positions of the frames the stage moved."""
    pairs = zip(align(walk, frames, left_out), frames, strict=True)
    return np.array([(found[0] != read(walk, frame)[0]).any(axis=1) for found, frame in pairs])


def turned(walk: Scene, frames: list[TrackerFrame]) -> Bools:
    """(F, S) which orientations of the frames the stage moved."""
    pairs = zip(align(walk, frames), frames, strict=True)
    return np.array([(found[1] != read(walk, frame)[1]).any(axis=1) for found, frame in pairs])


def assert_same_pose(found: tuple[Floats, Floats], wanted: tuple[Floats, Floats], rows: Bools) -> None:
    np.testing.assert_allclose(found[0][rows], wanted[0][rows], atol=1e-9)
    assert rotations.angle_between_rad(found[1][rows], wanted[1][rows]).max() < 1e-9


def test_uniform_motion_is_brought_to_one_instant(walk: Scene, rng: np.random.Generator) -> None:
    motion = Motion(rng, degree=1)
    for index, found in list(enumerate(align(walk, motion.frames(6))))[2:]:
        assert_same_pose(found, read(walk, motion.at_one_instant(index)), EVERY)


def test_a_parabola_is_interpolated_and_a_mean_velocity_extrapolated(walk: Scene, rng: np.random.Generator) -> None:
    """The mean velocity is that of a period T ago: x after the last reading, x (x + 2 T) p'' / 2 is missing."""
    motion = Motion(rng, degree=2)
    found, wanted = align(walk, motion.frames(3))[2], read(walk, motion.at_one_instant(2))
    assert_same_pose(found, wanted, AFTER)
    left_m = -SLOT_S * (2.0 * PERIOD_S - SLOT_S) * np.linalg.norm(motion.coefficients[2], axis=1)
    missing_m = np.linalg.norm(found[0] - wanted[0], axis=1)
    np.testing.assert_allclose(missing_m[BEFORE], left_m[BEFORE], atol=1e-9)


def test_stations_that_never_report_together_are_aligned_among_themselves(
    walk: Scene, rng: np.random.Generator
) -> None:
    motion = Motion(rng, degree=1)
    frames = [drop_stations(f, [3, 4, 5] if i == 0 else [0, 1, 2]) for i, f in enumerate(motion.frames(4))]
    theirs = motion.frame(np.full(6, 7.0 + PERIOD_S * 3 + SLOT_S[3:].mean()))
    assert_same_pose(align(walk, frames)[3], read(walk, theirs), np.arange(6) > 2)


def test_the_gate_learns_when_each_station_was_sampled(walk: Scene, rng: np.random.Generator) -> None:
    frames = Motion(rng, degree=1).frames(3)
    frames[1] = replace(drop_stations(frames[1], [0]), suspect=np.arange(6) == 3)
    frames.append(Motion(rng, degree=1).at_one_instant(3))
    gate = ChosenOutliers({})
    reader = reader_of(walk, gate)
    for frame in frames:
        reader.read(frame)
    np.testing.assert_allclose(gate.offsets_s[0], SLOT_S, atol=1e-12)
    np.testing.assert_allclose(gate.offsets_s[1], np.where(np.isin(np.arange(6), [0, 3]), 0.0, SLOT_S), atol=1e-12)
    np.testing.assert_allclose(gate.offsets_s[2], SLOT_S, atol=1e-12)
    np.testing.assert_array_equal(gate.offsets_s[3], np.zeros(6))


def test_a_station_at_rest_stays_as_it_is(walk: Scene, rng: np.random.Generator) -> None:
    still = Motion(rng, degree=0)
    still.rate_rad_s[:] = 0.0
    frames = still.frames(4)
    for frame, (target_m, world_from_target) in zip(frames, align(walk, frames), strict=True):
        np.testing.assert_array_equal(target_m, read(walk, frame)[0])
        np.testing.assert_array_equal(world_from_target, read(walk, frame)[1])


def test_what_counts_as_motion_is_documented() -> None:
    """docs/methods.md, temporal alignment."""
    assert (MAX_STEP_S, MAX_BEND_M, MAX_TURN_RAD) == (0.04, 0.06, 0.6)


def test_uneven_periods_are_as_exact(walk: Scene, rng: np.random.Generator) -> None:
    motion, start_s = Motion(rng, degree=1), np.cumsum([0.0, 0.02, 0.035, 0.013, 0.03])
    found = align(walk, [motion.frame(t + SLOT_S) for t in start_s])
    for index in (2, 3, 4):
        assert_same_pose(found[index], read(walk, motion.frame(np.full(6, start_s[index]))), EVERY)


def test_readings_of_one_time_stay_the_same_to_the_bit(walk: Scene) -> None:
    for frame, (target_m, world_from_target) in zip(walk.frames, align(walk, walk.frames), strict=True):
        np.testing.assert_array_equal(target_m, read(walk, frame)[0])
        np.testing.assert_array_equal(world_from_target, read(walk, frame)[1])


def test_after_a_loss_three_positions_and_two_orientations_are_needed(walk: Scene, rng: np.random.Generator) -> None:
    frames = Motion(rng, degree=1).frames(8)
    frames[3] = drop_stations(frames[3], [0])
    others = slice(1, None)
    assert moved(walk, frames)[2:, others].all()
    assert moved(walk, frames)[:, 0].tolist() == [False, False, True, False, False, False, True, True]
    assert turned(walk, frames)[:, 0].tolist() == [False, True, True, False, False, True, True, True]


def test_a_position_that_is_left_out_moves_nothing(walk: Scene, rng: np.random.Generator) -> None:
    frames = Motion(rng, degree=1).frames(8)
    found = moved(walk, frames, left_out={3: [0]})
    assert found[:, 0].tolist() == [False, False, True, False, False, False, True, True]
    assert found[2:, 1:].all()


def test_an_orientation_that_is_left_out_moves_nothing(walk: Scene, rng: np.random.Generator) -> None:
    frames = Motion(rng, degree=1).frames(6)
    found = align(walk, frames, left_out={3: [6]})
    assert [bool((t[1] != read(walk, f)[1])[0].any()) for f, t in zip(frames, found, strict=True)] == [
        *(False, True, True, False, False, True)
    ]


@pytest.mark.parametrize(("size", "kept"), [(1.05, True), (0.95, False)])
def test_an_echo_below_the_gate_is_not_extrapolated(
    walk: Scene, rng: np.random.Generator, size: float, kept: bool
) -> None:
    """It bends the path at three frames: when it comes, and in the two frames after it."""
    motion = Motion(rng, degree=1)
    frames = motion.frames(6)
    position_m = frames[3].position_m.copy()
    position_m[0, 2] += size * MAX_BEND_M
    frames[3] = replace(frames[3], position_m=position_m)
    assert moved(walk, frames)[3, 0] != kept
    assert not moved(walk, frames)[4, 0], "its bend is twice as large"
    assert moved(walk, frames)[3:, 1:].all()


@pytest.mark.parametrize(("share", "moves"), [(0.95, True), (1.05, False)])
def test_readings_far_apart_are_no_motion(walk: Scene, rng: np.random.Generator, share: float, moves: bool) -> None:
    motion = Motion(rng, degree=1)
    frames = [motion.frame(share * MAX_STEP_S * index + SLOT_S) for index in range(5)]
    assert (moved(walk, frames)[4] == moves).all()
    assert (turned(walk, frames)[4] == moves).all()


@pytest.mark.parametrize(("share", "moves"), [(0.95, True), (1.05, False)])
def test_a_jump_of_an_orientation_is_no_motion(
    walk: Scene, rng: np.random.Generator, share: float, moves: bool
) -> None:
    frames = Motion(rng, degree=1).frames(3)
    turn = rotations.exp(np.array([0.0, share * MAX_TURN_RAD, 0.0]))
    frames[2] = replace(
        frames[1],
        measured_s=frames[2].measured_s,
        tracker_from_station=rotations.multiply(turn, frames[1].tracker_from_station),
    )
    assert (turned(walk, frames)[2] == moves).all()


def test_a_suspect_record_is_left_alone_with_its_time(walk: Scene, rng: np.random.Generator) -> None:
    motion = Motion(rng, degree=1)
    frames = motion.frames(8)
    stamps_s = frames[4].measured_s.copy()
    stamps_s[1] += 100.0
    frames[4] = replace(frames[4], measured_s=stamps_s, suspect=np.arange(6) == 1)
    found = align(walk, frames)
    assert moved(walk, frames)[:, 1].tolist() == [False, False, True, True, False, False, False, True]
    for index in (4, 5, 6, 7):
        assert_same_pose(found[index], read(walk, motion.at_one_instant(index)), np.arange(6) != 1)


def test_a_silent_station_does_not_move_the_instant(walk: Scene, rng: np.random.Generator) -> None:
    motion = Motion(rng, degree=1)
    frames = motion.frames(10)
    for index, lost in {4: [0], 5: [0, 1], 6: [0, 1, 2], 7: [5]}.items():
        frames[index] = drop_stations(frames[index], lost)
    found = align(walk, frames)
    for index in range(2, 10):
        rows = np.array([all(f.position_valid[s] for f in frames[index - 2 : index + 1]) for s in range(6)])
        assert rows.any()
        assert_same_pose(found[index], read(walk, motion.at_one_instant(index)), rows)


def test_a_station_that_joins_late_takes_part_in_the_mean(walk: Scene, rng: np.random.Generator) -> None:
    motion = Motion(rng, degree=1)
    frames = [
        drop_stations(f, {0: [4, 5], 1: [4, 5], 2: [5], 3: [0], 4: [0]}.get(i, []))
        for i, f in enumerate(motion.frames(8))
    ]
    found = align(walk, frames)
    two_later = motion.frame(np.full(6, 7.0 + PERIOD_S * 2 + SLOT_S[:5].mean()))
    assert_same_pose(found[2], read(walk, two_later), np.arange(6) < 4)
    for index in (3, 4):
        assert_same_pose(
            found[index], read(walk, motion.at_one_instant(index)), (np.arange(6) > 0) & (np.arange(6) < 4)
        )
    assert_same_pose(found[7], read(walk, motion.at_one_instant(7)), EVERY)


def test_later_frames_change_nothing(walk: Scene, rng: np.random.Generator) -> None:
    frames = Motion(rng, degree=2).frames(8)
    for longer, shorter in zip(align(walk, frames), align(walk, frames[:5]), strict=False):
        np.testing.assert_array_equal(longer[0], shorter[0])
        np.testing.assert_array_equal(longer[1], shorter[1])


def test_noise_of_resting_stations_grows_little(walk: Scene, rng: np.random.Generator) -> None:
    """Interpolation reduces the variance; extrapolation over a share x of the period raises it.

    The factor is (1 + x / 2)^2 + (x / 2)^2 for positions. It is (1 + x)^2 + x^2 for orientations, by the last step.
    """
    still = Motion(rng, degree=0)
    still.rate_rad_s[:] = 0.0
    frames = [
        replace(
            frame,
            position_m=frame.position_m + rng.normal(0.0, 0.001, (6, 3)),
            tracker_from_station=rotations.multiply(
                rotations.exp(rng.normal(0.0, 0.001, (6, 3))), frame.tracker_from_station
            ),
        )
        for frame in still.frames(2000)
    ]
    at_rest = read(walk, still.at_one_instant(0))
    found = align(walk, frames)
    position = np.std([target_m - at_rest[0] for target_m, _ in found], axis=(0, 2)) / 0.001
    angle_rad = [rotations.angle_between_rad(turn, at_rest[1]) for _, turn in found]
    orientation = np.sqrt(np.mean(np.square(angle_rad), axis=0) / 3.0) / 0.001
    x = -SLOT_S / PERIOD_S
    np.testing.assert_allclose(orientation, np.sqrt((1.0 + x) ** 2 + x**2), rtol=0.05)
    np.testing.assert_allclose(position[BEFORE], np.sqrt((1.0 + x / 2.0) ** 2 + x**2 / 4.0)[BEFORE], rtol=0.05)
    assert (position[AFTER] < 1.0).all()
    assert position.max() < 1.2
    assert orientation.max() < 1.4


METHODS = {
    **{f"{name}[align=true]": name for name in ("ik", "local_pca", "dynamic_map", "kernel_cca", "weighted_blend")},
    "mean_pose+ik[align=true]": "mean_pose+ik",
}
"""With the option -> without."""


@pytest.mark.parametrize(("name", "without"), METHODS.items())
def test_every_method_has_the_option(name: str, without: str, boxing: Scene) -> None:
    """Off by default; on, it changes no bit of readings of one time, and removes error where stations take turns."""
    plain, aligned = registry.make_method(without), registry.make_method(name)
    exact = boxing.frames[:12]
    for one, other in zip(boxing.run(plain, exact), boxing.run(aligned, exact), strict=True):
        np.testing.assert_array_equal(one.qpos, other.qpos)
    mounts = [DEFAULT_MOUNTS[station] for station in boxing.calibration.stations]
    simulated = simulate_tracker(boxing.body, boxing.take, mounts, TrackerConfig(), Noise(), seed=1)
    scene = replace(boxing, calibration=simulated.calibration, frames=list(simulated.frames))
    truth = joint_centres_m(boxing.body.skeleton, simulated.truth_qpos[simulated.frame_index])

    def error_m(method: str) -> float:
        found = np.array([e.qpos for e in scene.run(registry.make_method(method))])
        return float(np.linalg.norm(joint_centres_m(boxing.body.skeleton, found) - truth, axis=2)[10:].mean())

    assert error_m(name) < 0.9 * error_m(without)
