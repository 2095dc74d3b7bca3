"""The report on a validated capture, from what the registration showed."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness.core.arrays import Floats
from harness.experiment.evaluation import Evaluation
from harness.measure.measured import NORMAL_QUANTILE, Measured
from harness.report.lab.unit_content import CaptureSummary, DepartureCheck
from harness.report.lab.validation_content import (
    ROOM,
    EstimatedPose,
    ReconstructionScore,
    RegistrationNumber,
    ResidualSeries,
    StationAccuracy,
    ValidationReport,
)
from harness.study.trust.validation import Validation


def validation_report(found: Validation, path: Path, command: str, scores: Sequence[Evaluation]) -> ValidationReport:
    """The report on the capture at `path`."""
    registration, wire = found.registration, found.reader.wire
    expected = round(registration.overlap_s * wire.rate_hz)
    return ValidationReport(
        name=path.stem,
        command=command,
        capture=CaptureSummary(
            path.name, found.duration_s, wire.stations, wire.rate_hz, damage=tuple(found.reader.damage)
        ),
        truth=found.truth.title,
        matched_frames=round(registration.matched * expected),
        expected_frames=expected,
        expected_from=found.expected_from,
        numbers=tuple(RegistrationNumber(key, number) for key, number in found.numbers.items()),
        poses=(_room(found), *(_mount(found, station) for station in registration.mounts)),
        accuracy=tuple(
            StationAccuracy(
                station,
                one.position.rms,
                one.position.median,
                one.position.quantile95,
                one.orientation.rms,
                one.orientation.median,
                one.orientation.quantile95,
                one.readings,
                one.lost_share,
            )
            for station, one in found.stations.items()
        ),
        checks=tuple(DepartureCheck(check.departure, check.p_holm) for check in found.checks),
        residuals=tuple(_residuals(found, station) for station in registration.errors),
        scores=tuple(
            ReconstructionScore(one.method, metric, one.metrics[metric]) for one in scores for metric in one.names
        ),
        exchanged=tuple(
            f"{station} is on {body}, not on {found.truth.body_of[station]}: stations are exchanged."
            for station, body in found.exchanged.items()
        ),
        notes=(
            *found.notes,
            *found.truth.notes,
            "Errors are those after the registration: constant errors of room and mounts are in its numbers.",
        ),
    )


def _room(found: Validation) -> EstimatedPose:
    registration = found.registration
    origin = tuple(registration.values[f"tracker_origin_m.{axis}"] for axis in range(3))
    covariance = registration.room_covariance[:3, :3]
    return EstimatedPose(ROOM, "", _three(origin), registration.world_from_tracker, _half_width_rad(covariance))


def _mount(found: Validation, station: str) -> EstimatedPose:
    mount = found.registration.mounts[station]
    axes = _three(tuple(mount.position(axis) for axis in range(3)))
    angle_rad = _half_width_rad(mount.covariance[:3, :3])
    return EstimatedPose(station, mount.body, axes, mount.body_from_station, angle_rad)


def _three(values: tuple[Measured, ...]) -> tuple[Measured, Measured, Measured]:
    x, y, z = values
    return x, y, z


def _half_width_rad(covariance: Floats) -> float:
    return NORMAL_QUANTILE * float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))


def _residuals(found: Validation, station: str) -> ResidualSeries:
    errors = found.registration.errors[station]
    position_m, angle_rad = (
        np.where(errors.valid, np.linalg.norm(values, axis=1), np.nan)
        for values in (errors.position_m, errors.rotation_rad)
    )
    return ResidualSeries(station, errors.truth_s - errors.truth_s[0], position_m, angle_rad)
