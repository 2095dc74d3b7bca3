"""Prediction and enhancement of a physical tracker, by the settings of each station (docs/is900.md 4.2)."""

import numpy as np

from harness.core import rotations
from harness.simulate.physics.fusion import Fusion
from harness.simulate.readings import SimulatedReadings
from harness.stream.codec.samples import FilterSamples


def filter_samples(readings: SimulatedReadings, fusion: Fusion) -> FilterSamples | None:
    """What prediction and enhancement need, with the faults of the readings; None where it was not kept.

    A fault moves the poses of every enhancement mode alike. A station that is lost does not move.
    """
    found = readings.filter
    if found is None or found.motion is None:
        return None
    turned = rotations.multiply(readings.turn, rotations.inverse(found.tracker_from_station))
    moves = ~readings.affected.get("lost", np.zeros(readings.time_s.shape, dtype=bool))[..., None]
    return FilterSamples(
        velocity_m_s=np.where(moves, found.motion.velocity_m_s, 0.0),
        turn_rad_s=np.where(moves, found.motion.turn_rad_s, 0.0),
        enhanced_position_m=found.motion.enhanced_position_m + (readings.position_m - found.position_m),
        enhanced_tracker_from_station=rotations.multiply(turned, found.motion.enhanced_tracker_from_station),
        ranges_received=found.ranges_received.astype(np.int64),
        ranges_rejected=found.ranges_rejected.astype(np.int64),
        emitters=readings.emitters,
        prediction_ms=np.array([fusion.prediction_ms.get(station, 0) for station in readings.stations]),
        enhancement=np.array([fusion.enhancement.get(station, 0) for station in readings.stations]),
    )


def apply_device_settings(readings: SimulatedReadings, fusion: Fusion) -> None:
    """Change the readings to what the stations report with the scenario's prediction and enhancement."""
    samples = filter_samples(readings, fusion)
    if samples is not None:
        readings.position_m, readings.turn = samples.report_poses(
            readings.position_m, readings.turn, samples.prediction_ms, samples.enhancement
        )
