"""Truth in, tracker stream out: replay, errors, the device's bytes, the line, and the decoder of the real driver.

The frames that come out were encoded as IS-900 records and decoded again, so float32 rounding, the quantised clock
and the order of stations are in them as they are on a desk.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.body.humanoid import Body
from harness.body.mounts import Mount, place
from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.calibration import Calibration
from harness.core.motion import Take
from harness.errors import BadInput
from harness.simulate.link import BITS_PER_BYTE, carry
from harness.simulate.noise import Clock, Noise
from harness.simulate.readings import Readings
from harness.simulate.trajectory import Trajectory
from harness.stream.assemble import FrameAssembler
from harness.stream.decoder import Decoder, Records
from harness.stream.frame import TrackerFrame
from harness.stream.records import LIST, STATIONS, blank_records, record_type

WORLD_FROM_TRACKER: Floats = np.array([0.0, 1.0, 0.0, 0.0])
"""The IS-900's axes: x forward, y right, z down (docs/is900.md 5.3)."""
TRACKER_ORIGIN_M: Floats = np.array([0.0, 0.0, 2.5])
"""Under the ceiling, where the emitters hang (choice)."""
_CM = 0.01


@dataclass(frozen=True)
class TrackerConfig:
    """The device and its line."""

    rate_hz: float = 40.0
    """Liu et al. 2011."""
    latency_s: float = 0.004
    """From a measurement to its record being ready; docs/is900.md 13.1, unverified."""
    skew_s: float = 0.002
    """From one station's measurement to the next one's (choice: no source)."""
    baud: float = 115200.0
    queue_records: int = 24
    """How many records the device holds back when the line is busy (choice: two rounds of twelve stations)."""


@dataclass(frozen=True, eq=False)
class Simulation:
    """One take as a receiver saw it, and the truth beside it; E instants, F frames, S stations."""

    stations: tuple[str, ...]
    frames: tuple[TrackerFrame, ...]
    """Decoded from `wire`."""
    wire: bytes
    """Everything that the host received."""
    arrived_s: Floats
    """(N,) when the last byte of each record of `wire` was in [s]."""
    readings: Readings
    """What the device meant to say."""
    truth_s: Floats
    """(E,) the mean of the stations' true times of measurement [s]; what the truth and an estimate are compared at."""
    truth_qpos: Floats
    """(E, 55)"""
    frame_index: Ints
    """(F,) the instant that each frame is of, found through the device's time."""
    calibration: Calibration
    health: Mapping[str, float]


def simulate(
    body: Body, take: Take, mounts: Sequence[Mount], tracker: TrackerConfig, noise: Noise, *, seed: int
) -> Simulation:
    """Wear the trackers through a take. BadInput for a take shorter than two periods, or a line that is too slow."""
    stations = tuple(mount.station for mount in mounts)
    _check(take, stations, tracker)
    trajectory = Trajectory(body, take)
    last_s = tracker.skew_s * (len(stations) - 1)
    count = int(np.floor((trajectory.duration_s - last_s) * tracker.rate_hz + 1e-9)) + 1
    tick_s = np.arange(count) / tracker.rate_hz
    calibration = exact(body, mounts)
    truth = _true_readings(trajectory, calibration, tick_s, tracker)
    readings = noise.applied(truth, seed, take.name)
    wire, arrived_s, dropped = _transmitted(readings, tracker, noise.clock)
    frames = _received(wire, arrived_s, stations, tracker)
    truth_s = tick_s + 0.5 * last_s
    return Simulation(
        stations=stations,
        frames=tuple(frames),
        wire=wire,
        arrived_s=arrived_s,
        readings=readings,
        truth_s=truth_s,
        truth_qpos=trajectory.qpos(truth_s),
        frame_index=_matched(frames, noise.clock, tracker),
        calibration=calibration,
        health=_health(readings, frames, wire, arrived_s, dropped, tracker),
    )


def exact(body: Body, mounts: Sequence[Mount]) -> Calibration:
    """The calibration that nobody has: mounts and room as they truly are."""
    placed = [place(body.skeleton, mount) for mount in mounts]
    return Calibration(
        kind="exact",
        stations=tuple(mount.station for mount in mounts),
        bones=tuple(mount.bone for mount in mounts),
        mount_m=np.array([origin for origin, _ in placed]),
        bone_from_station=np.array([turn for _, turn in placed]),
        world_from_tracker=WORLD_FROM_TRACKER,
        tracker_origin_m=TRACKER_ORIGIN_M,
    )


def _check(take: Take, stations: tuple[str, ...], tracker: TrackerConfig) -> None:
    if not 0 < len(stations) <= len(STATIONS) or len(set(stations)) < len(stations):
        raise BadInput(f"stations {', '.join(stations) or 'none'}.", f"1 to {len(STATIONS)}, each with its own name.")
    if (len(take) - 1) / take.rate_hz < 2.0 / tracker.rate_hz + tracker.skew_s * len(stations):
        raise BadInput(f"{take.name} lasts {len(take) / take.rate_hz:.2f} s.", "Two tracker periods are needed.")
    if tracker.skew_s * len(stations) > 1.0 / tracker.rate_hz:
        raise BadInput(
            f"{len(stations)} stations, {tracker.skew_s} s apart, do not fit into a period at {tracker.rate_hz} Hz.",
            "Lower tracker.rate_hz or tracker.skew_s.",
        )


def _true_readings(
    trajectory: Trajectory, calibration: Calibration, tick_s: Floats, tracker: TrackerConfig
) -> Readings:
    """Where the stations truly are in the tracker's frame, each at its own moment."""
    tracker_from_world = rotations.inverse(calibration.world_from_tracker)
    position, orientation, velocity = [], [], []
    time_s = tick_s[:, None] + tracker.skew_s * np.arange(len(calibration.stations))
    for k, bone in enumerate(calibration.bones):
        moving = trajectory.bone(bone, time_s[:, k]).at(calibration.mount_m[k])
        world_from_station = rotations.multiply(
            rotations.from_matrix(moving.world_from_it), calibration.bone_from_station[k]
        )
        position.append(rotations.rotate(tracker_from_world, moving.position_m - calibration.tracker_origin_m))
        orientation.append(rotations.multiply(tracker_from_world, world_from_station))
        velocity.append(rotations.rotate(tracker_from_world, moving.velocity_m_s))
    return Readings(
        stations=calibration.stations,
        rate_hz=tracker.rate_hz,
        time_s=time_s,
        position_m=np.stack(position, axis=1),
        tracker_from_station=np.stack(orientation, axis=1),
        velocity_m_s=np.stack(velocity, axis=1),
        quality=np.ones(time_s.shape),
    )


def _transmitted(readings: Readings, tracker: TrackerConfig, clock: Clock) -> tuple[bytes, Floats, int]:
    """The bytes that reach the host, when each of their records does, and how many records did not."""
    count, stations = readings.time_s.shape
    records = blank_records(count * stations)
    records["station"] = np.tile(np.frombuffer(STATIONS[:stations], "S1"), count)
    records["quality"] = np.rint(255.0 * readings.quality).astype(np.uint8).ravel()
    records["position"] = readings.position_m.reshape(-1, 3) / _CM
    records["quaternion"] = readings.tracker_from_station.reshape(-1, 4)
    records["time"] = 1e3 * (readings.time_s.ravel() * (1.0 + 1e-6 * clock.ppm) + clock.offset_s)
    ready_s = readings.time_s.ravel() + tracker.latency_s
    carried = carry(ready_s, records.itemsize, tracker.baud, tracker.queue_records)
    sent = carried.sent
    return records[sent].tobytes(), carried.arrived_s[sent], int(np.count_nonzero(~sent))


def _received(wire: bytes, arrived_s: Floats, stations: tuple[str, ...], tracker: TrackerConfig) -> list[TrackerFrame]:
    """What the driver makes of the bytes."""
    assembler = FrameAssembler(stations, 1.0 / tracker.rate_hz, _CM)
    frames: list[TrackerFrame] = []
    size = record_type(LIST).itemsize
    for event in Decoder(LIST).feed(wire):
        if isinstance(event, Records):
            frames += assembler.push(event.records, arrived_s[event.end // size - 1])
    return frames + assembler.flush()


def _matched(frames: Sequence[TrackerFrame], clock: Clock, tracker: TrackerConfig) -> Ints:
    """(F,) from the first station's time that a frame knows."""
    measured_s = np.array([frame.measured_s for frame in frames]).reshape(len(frames), -1)
    true_s = (measured_s - clock.offset_s) / (1.0 + 1e-6 * clock.ppm)
    ticks = (true_s - tracker.skew_s * np.arange(true_s.shape[1])) * tracker.rate_hz
    return np.rint(np.nanmean(ticks, axis=1)).astype(np.int64) if len(frames) else np.empty(0, dtype=np.int64)


def _health(
    readings: Readings,
    frames: Sequence[TrackerFrame],
    wire: bytes,
    arrived_s: Floats,
    dropped: int,
    tracker: TrackerConfig,
) -> dict[str, float]:
    """Counts of what the stream lost, and how late it was."""
    size = record_type(LIST).itemsize
    counts = {f"readings_{name}": int(np.count_nonzero(hit)) for name, hit in readings.marks.items()}
    late_ms = 1e3 * (np.array([f.received_s for f in frames]) - np.array([_last_s(f) for f in frames]))
    return {
        "instants": len(readings.time_s),
        "frames": len(frames),
        "records_sent": len(arrived_s),
        "records_dropped_by_the_line": dropped,
        "readings": int(readings.quality.size),
        "readings_invalid": int(sum(np.count_nonzero(~f.position_valid) for f in frames)),
        "readings_suspect": int(sum(np.count_nonzero(f.suspect) for f in frames)),
        **counts,
        "line_load": size * BITS_PER_BYTE * len(readings.stations) * tracker.rate_hz / tracker.baud,
        "frame_latency_p50_ms": float(np.median(late_ms)) if len(frames) else float("nan"),
        "frame_latency_p99_ms": float(np.percentile(late_ms, 99)) if len(frames) else float("nan"),
    }


def _last_s(frame: TrackerFrame) -> float:
    return float(np.nanmax(frame.measured_s))
