"""Simulation of an IS-900: from true motion to device bytes, decoded as the driver decodes them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.body import Body, Mount, locate_mount
from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints, freeze
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion, count_steps
from harness.core.stream_health import GROWN_ROOM, hearing_key
from harness.errors import BadInput
from harness.simulate.components.soft_tissue import skin_below, tissue_force_m_s2
from harness.simulate.link import TrackerConfig, transmit
from harness.simulate.noise import Noise
from harness.simulate.physical_readings import apply_device_settings, simulate_physical_readings
from harness.simulate.readings import SimulatedReadings
from harness.simulate.trajectory import Trajectory
from harness.stream import TrackerFrame
from harness.stream.polhemus.codec import (
    ByteCapture,
    FrameReader,
    RecordValues,
    WireFormat,
    encode_records,
    position_range_m,
)

__all__ = ["Simulation", "TrackerConfig", "simulate_readings", "simulate_tracker", "transmit_readings"]

WORLD_FROM_TRACKER: Floats = np.array([0.0, 1.0, 0.0, 0.0])
"""The tracker's axes are x forward, y right, z down (docs/is900.md 5.3): half a turn about x from the world's."""


@dataclass(frozen=True, eq=False)
class Simulation:
    """A take as the tracker reports it, and the truth next to it. Frames carry no truth."""

    wire_format: WireFormat
    wire: ByteCapture
    """Received bytes, record by record."""
    frames: tuple[TrackerFrame, ...]
    """(F,) decoded from `wire`."""
    frame_index: Ints
    """(F,) index of each decoded frame among the E sampled frames; -1 for a frame without a time and for the later
    parts of one that an overloaded line split."""
    truth_s: Floats
    """(E,) reference time of each sampled frame: the mean of its stations' true sampling times [s]."""
    truth_qpos: Floats
    """(E, 55) true configuration at that time."""
    calibration: Calibration
    """Exact mounts and tracker frame."""
    health: dict[str, float]
    """Counts, shares and latencies of the stream, for the report."""

    def __post_init__(self) -> None:
        freeze(self, np.int64, frame_index=(len(self.frames),))
        freeze(self, truth_s=("E",))
        freeze(self, truth_qpos=(len(self.truth_s), "Q"))

    @property
    def stations(self) -> tuple[str, ...]:
        return self.wire_format.stations

    @property
    def expected(self) -> int:
        """Number of sampled frames, E."""
        return len(self.truth_s)


def simulate_tracker(
    body: Body,
    take: BodyMotion,
    mounts: Sequence[Mount],
    tracker: TrackerConfig,
    noise: Noise,
    *,
    seed: int,
    session: str = "",
) -> Simulation:
    """Simulate the trackers of a take, from true motion to decoded frames.

    The result's calibration is `exact`: true mounts and the tracker's true frame. Takes of one `session` share the
    errors that are constant for a session; with "" the take is a session of its own. BadInput when the take is shorter
    than one sampling period.
    """
    wire_format = WireFormat(tuple(mount.station for mount in mounts), tracker.rate_hz, tracker.items)
    trajectory = Trajectory(body, take)
    time_s = sampling_times_s(trajectory.duration_s, tracker, len(mounts))
    calibration = exact_calibration(body, mounts, tracker)
    readings = simulate_readings(trajectory, mounts, tracker, noise, time_s, seed=seed, take=take.name, session=session)
    if noise.physics is not None:
        apply_device_settings(readings, noise.physics.fusion)
    sent, wire = transmit_readings(readings, wire_format, tracker)
    reader = FrameReader(wire_format)
    frames = (*reader.feed_all(wire), *reader.finish())
    truth_s = time_s.mean(axis=1)
    return Simulation(
        wire_format=wire_format,
        wire=wire,
        frames=frames,
        frame_index=_match_frames(frames, readings.device_s),
        truth_s=truth_s,
        truth_qpos=trajectory.qpos(truth_s),
        calibration=calibration,
        health=_health(readings, sent, wire, frames, tracker.items, int(reader.out_of_range.sum())),
    )


def sampling_times_s(duration_s: float, tracker: TrackerConfig, stations: int) -> Floats:
    """(E, S) sampling times of each station in each frame of a take of this length [s]; BadInput if it has none."""
    slots_s = tracker.station_slot_s(stations) * np.arange(stations)
    count_steps(duration_s * stations, 1.0 / tracker.rate_hz, "Records of the simulated take")
    count = int(np.floor((duration_s - slots_s[-1]) * tracker.rate_hz + 1e-9)) + 1
    if count < 1:
        raise BadInput(f"A take of {duration_s:.3f} s is shorter than one frame.", "Choose a longer one.")
    return np.arange(count)[:, None] / tracker.rate_hz + slots_s


def exact_calibration(body: Body, mounts: Sequence[Mount], tracker: TrackerConfig) -> Calibration:
    """Calibration of kind `exact`: the true mounts and the tracker's true frame."""
    mounts_on_bones = [locate_mount(body.skeleton, mount) for mount in mounts]
    return Calibration(
        kind="exact",
        stations=tuple(mount.station for mount in mounts),
        bones=tuple(mount.bone for mount in mounts),
        mount_m=np.array([mount_m for mount_m, _ in mounts_on_bones]),
        bone_from_station=np.array([bone_from_station for _, bone_from_station in mounts_on_bones]),
        world_from_tracker=WORLD_FROM_TRACKER,
        tracker_origin_m=np.array(tracker.origin_m),
    )


def simulate_readings(
    trajectory: Trajectory,
    mounts: Sequence[Mount],
    tracker: TrackerConfig,
    noise: Noise,
    time_s: Floats,
    *,
    seed: int,
    take: str,
    begins_s: float = 0.0,
    ends_s: float | None = None,
    session: str = "",
) -> SimulatedReadings:
    """Readings at sampling times (E, S) of a trajectory, with noise applied, before they are encoded.

    `begins_s` is added to the times: the trajectory's beginning by the device's clock and by the times of faults [s].
    `ends_s` is the last sampling time of the take, if a way back follows it in the same trajectory [s]; a physical
    tracker then keeps what the device's settings need. `take` and `session` are names that key the random draws.
    """
    calibration = exact_calibration(trajectory.body, mounts, tracker)
    skin = skin_below(trajectory.body.skeleton, mounts, calibration)
    if noise.physics is None:
        measured = _ideal_readings(trajectory, calibration, time_s)
    else:
        found, constellation, room = simulate_physical_readings(
            *(trajectory, mounts, calibration, noise, noise.physics, time_s),
            seed=seed,
            take=take,
            session=session,
            ends_s=ends_s,
        )
        unknown = np.broadcast_to(np.nan, (*time_s.shape, 3))  # only statistical components ask for these
        measured = {
            "velocity_m_s": unknown,
            "force_m_s2": unknown,
            "position_m": found.position_m,
            "turn": found.tracker_from_station,
            "quality": found.quality,
            "filter": found,
            "emitters": constellation.emitters,
            "grown_room_m": None if room.extent_m[:2] == noise.physics.room.extent_m[:2] else room.extent_m,
        }
    readings = SimulatedReadings(
        seed=seed,
        take=take,
        stations=calibration.stations,
        time_s=time_s + begins_s,
        rate_hz=tracker.rate_hz,
        radius_m=skin.radius_m,
        tissue_m=skin.tissue_m,
        device_s=time_s + begins_s,
        session=session,
        **measured,
    )
    noise.apply(readings)
    return readings


def _ideal_readings(trajectory: Trajectory, calibration: Calibration, time_s: Floats) -> dict[str, Any]:
    """The fields of readings that depend on the motion, as an ideal tracker measures them."""
    motion = trajectory.station_motion(calibration, time_s)
    tracker_from_world = rotations.inverse(calibration.world_from_tracker)
    return {
        "velocity_m_s": rotations.rotate(tracker_from_world, motion.velocity_m_s),
        "force_m_s2": tissue_force_m_s2(motion.world_from_station, motion.acceleration_m_s2, calibration),
        "position_m": rotations.rotate(tracker_from_world, motion.position_m - calibration.tracker_origin_m),
        "turn": rotations.multiply(tracker_from_world, motion.world_from_station),
        "quality": np.ones(time_s.shape),
    }


def transmit_readings(
    readings: SimulatedReadings, wire_format: WireFormat, tracker: TrackerConfig
) -> tuple[Bools, ByteCapture]:
    """Encode and transmit: (E*S,) which records got through the line, in sampling order, and the received bytes."""
    characters = np.tile(np.frombuffer(wire_format.characters, np.uint8), len(readings.time_s))
    values = RecordValues(
        readings.device_s.ravel(),
        readings.position_m.reshape(-1, 3),
        readings.turn.reshape(-1, 4),
        readings.quality.ravel(),
    )
    table = encode_records(wire_format.items, characters, values, wire_format.settings)
    sent, arrived_s = transmit(readings.time_s.ravel() + tracker.latency_s, tracker)
    ends = table.itemsize * np.arange(1, int(sent.sum()) + 1)
    return sent, ByteCapture(table[sent].tobytes(), ends, arrived_s[sent])


def _match_frames(frames: Sequence[TrackerFrame], device_s: Floats) -> Ints:
    """(F,) index of each decoded frame among the sampled ones, by the device's time stamps (E, S); see `Simulation`."""
    first_s, period_s = device_s[0], np.diff(device_s[:2, 0])
    stamps_s = np.array([frame.measured_s for frame in frames]).reshape(-1, device_s.shape[1])
    if len(period_s) == 0:
        return np.zeros(len(frames), dtype=np.int64)
    stamped, out = np.isfinite(stamps_s).any(axis=1), np.full(len(frames), -1, dtype=np.int64)
    out[stamped] = np.round(np.nanmean((stamps_s[stamped] - first_s) / period_s, axis=1))
    before = np.maximum.accumulate(np.append(-1, out))[:-1]
    return np.where(out > before, out, -1)


def _health(
    readings: SimulatedReadings,
    sent: Bools,
    wire: ByteCapture,
    frames: Sequence[TrackerFrame],
    items: tuple[int, ...],
    out_of_range: int,
) -> dict[str, float]:
    delay_s = wire.received_s - readings.time_s.ravel()[sent]
    counts = {f"{name}_share": float(np.mean(hit)) for name, hit in readings.affected.items()}
    if readings.filter is not None:
        for station, hears, echoes in zip(
            readings.stations, readings.filter.coverage_share, readings.filter.echo_share, strict=True
        ):
            counts |= {hearing_key(station): float(hears), f"{station} echoes": float(echoes)}
    if readings.grown_room_m is not None:
        counts |= dict(zip(GROWN_ROOM, (*readings.grown_room_m, float(len(readings.emitters))), strict=True))
    return {
        "frames_sampled": float(len(readings.time_s)),
        "frames_received": float(len(frames)),
        "records_sent": float(sent.sum()),
        "records_dropped": float(len(sent) - sent.sum()),
        "readings_invalid": float(np.sum(~np.array([frame.position_valid for frame in frames], dtype=bool))),
        "readings_suspect": float(np.sum([frame.suspect for frame in frames])),
        "latency_p50_ms": 1e3 * float(np.quantile(delay_s, 0.5)),
        "latency_p99_ms": 1e3 * float(np.quantile(delay_s, 0.99)),
        **counts,
        **({"readings_out_of_range": float(out_of_range)} if position_range_m(items) else {}),
    }
