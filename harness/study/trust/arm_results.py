"""Cells of one capture: every arm on the device's frames and on simulations of the same motion.

The capture is decoded once, each simulation is made once, and each method is trained once for all of them. Finished
cells are kept in the folder of the study, so that a stopped study goes on where it was.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.fault_report import named_folder_fault
from harness.core.seeds import generator
from harness.errors import BadFile, BadInput, UnknownName
from harness.experiment import (
    ClipEvaluation,
    ObservedTake,
    checked_note,
    evaluate,
    find_playback,
    recorded_take,
    registered_take,
)
from harness.experiment.methods import DEFAULT_ISOLATION, NamedMethod, describe_failure, resolve_method
from harness.experiment.scenarios import Scenario
from harness.mocap import LibraryFolders
from harness.results import cell_key, source_hash
from harness.results.files import check_key, file_digest, read_result_json, write_result_json
from harness.score import LoopFrames
from harness.simulate import Noise, sampling_times_s, simulate_tracker
from harness.stream.recording import RecordingStream
from harness.study.trust.capture_readings import CaptureReadings
from harness.study.trust.logged_poses import open_capture
from harness.study.trust.pose_source import holds_poses
from harness.study.trust.reading_errors import (
    HealthCounts,
    count_health,
    reading_errors,
)
from harness.study.trust.truth_motion import truth_of_playback
from harness.study.trust.validation import validate_capture

_EXPECTED, _ADVICE = "the errors of a finished cell", "Delete the file and run again; finished cells are kept."


@dataclass(frozen=True)
class Arm:
    """A method with a set of stations, and the values of the parameters that the plan varies."""

    method: str
    set_name: str
    stations: tuple[str, ...]
    values: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        """Name in tables, such as "ik, six"."""
        texts = [f"{key.rpartition('.')[2]} = {value}" for key, value in self.values.items()]
        return ", ".join([self.method, self.set_name, *texts])


@dataclass(frozen=True)
class TrustTask:
    """One capture with everything that a worker process needs."""

    capture: Path
    clip: str
    """The clip that was performed; "" is the one that the capture names."""
    scenario_file: Path
    arms: tuple[Arm, ...]
    parameters: Mapping[str, Any]
    """As `Plan.parameters`."""
    metrics: tuple[str, ...]
    seeds: tuple[int, ...]
    unit: Mapping[str, Any] | None
    """Scenario keys and values of the fitted unit; None without one."""
    out: Path
    """Folder of the study; the cells are in `cells` there."""
    folder: LibraryFolders | None


@dataclass(eq=False)
class ArmResults:
    """What one capture gave. Errors of readings are those of `reading_errors`."""

    clip: str
    sha256: str
    frames: int
    damage: tuple[str, ...]
    notes: tuple[str, ...]
    """How the capture was related to its motion, where its clock does not tell."""
    stations: tuple[str, ...]
    rate_hz: float
    device: dict[str, dict[str, float | None]] = field(default_factory=dict)
    """Arm -> metric -> error on the device."""
    simulated: dict[str, list[dict[str, float | None]]] = field(default_factory=dict)
    """Arm -> for each seed, metric -> error; no metrics where the cell failed."""
    readings: tuple[dict[str, list[Floats]], ...] = ()
    """Errors of the device's readings, and of those of the first seed."""
    health: tuple[list[HealthCounts], ...] = ()
    """Counts of each station, of the device and of the first seed."""
    failures: dict[str, str] = field(default_factory=dict)
    """Cell -> why it has no result."""
    methods_s: float = 0.0
    """Time that training and methods took [s]; not part of any stored result."""


def run_capture(task: TrustTask) -> ArmResults:
    """Run or read all cells of a capture.

    BadFile, BadInput and UnknownName for a capture that is not of the scenario's motion and stations. A method that
    fails costs its own cells.
    """
    return _TrustTaskRun(task).run()


def find_stations(task: TrustTask) -> tuple[str, ...]:
    """Stations of a capture; raises as `run_capture` where its note or its stations do not fit."""
    return tuple(_TrustTaskRun(task).playback.scenario.worn_stations)


class _TrustTaskRun:
    """The evaluation of one capture; each part is made when it is first needed."""

    def __init__(self, task: TrustTask) -> None:
        self.task = task
        self.source: CaptureReadings | RecordingStream
        if holds_poses(task.capture):
            self.source = open_capture(task.capture)
            self.damage = self.source.damage
        else:
            self.source = RecordingStream(task.capture)
            self.damage = self.source.recording.damage
        self.note = checked_note(self.source)
        self.clip = task.clip or self.note.get("clip")
        if not self.clip:
            raise BadInput(f"Nothing says which clip {task.capture} is of.", "Name the clip of each with --truth.")
        if holds_poses(Path(self.clip)):
            raise BadInput(
                f"{self.clip} holds poses of bodies and no performer's motion, on which methods could be ranked.",
                f"Name a clip. `harness validate {task.capture} --truth {self.clip} --expect UNIT.toml` tells whether "
                "clock, scale and speed error are those of the simulation's unit.",
            )
        if self.note.get("posing"):
            raise BadInput(f"{task.capture} is of calibration poses.", "Name captures of motion.")
        self.playback = find_playback(
            self.source,
            scenario=str(task.scenario_file),
            clip=self.clip,
            rate_hz=self.note.get("rate_hz"),
            seed=self.note.get("seed"),
            folder=task.folder,
        )
        for arm in task.arms:
            for station in arm.stations:
                if station not in self.playback.scenario.worn_stations:
                    raise UnknownName(f"station in {task.capture}", station, self.playback.scenario.worn_stations)
        self.sha256 = file_digest(task.capture, "a capture", "")
        self.methods_s, self.failures = 0.0, dict[str, str]()

    def run(self) -> ArmResults:
        """Cells of both sides, errors of readings and health."""
        device = self._cells("device", {"capture": self.sha256}, lambda: self.device)
        simulated = []
        for seed in self.task.seeds:
            load = cache(partial(self._simulate, seed))
            simulated.append(self._cells(f"seed {seed}", self._identity(seed), load))
            if seed == self.task.seeds[0]:
                first = load()
        sides = (self.device, first)
        return ArmResults(
            clip=str(self.clip),
            sha256=self.sha256,
            frames=len(self.device.frames),
            damage=self.damage,
            notes=self.device.notes,
            stations=tuple(self.playback.scenario.worn_stations),
            rate_hz=self.device.rate_hz,
            device=device,
            simulated={str(arm): [each.get(str(arm), {}) for each in simulated] for arm in self.task.arms},
            readings=tuple(reading_errors(side) for side in sides),
            health=tuple(count_health(side) for side in sides),
            failures=self.failures,
            methods_s=self.methods_s,
        )

    @cached_property
    def device(self) -> ObservedTake:
        """The capture, decoded once.

        The frames of a played motion are found by the device's clock. A capture that names no clip itself, and which
        that clock does not relate to the named one, is registered with it, and so is every pose log.
        """
        if isinstance(self.source, RecordingStream):
            try:
                return recorded_take(self.source, self.playback)
            except BadInput:
                if not self.task.clip or self.note.get("clip"):
                    raise
        return self._registered()

    def _registered(self) -> ObservedTake:
        """The capture of a performer, related to the clip by `validate`, whose room and mounts methods receive.

        BadInput for motion or stations that are not those of the clip.
        """
        capture = self.source if isinstance(self.source, CaptureReadings) else open_capture(self.task.capture)
        found = validate_capture(capture, truth_of_playback(self.playback, host_clock=False))
        if found.exchanged:
            raise BadInput(f"{self.task.capture}: {', '.join(found.exchanged)} are exchanged.", "Name them anew.")
        take = registered_take(capture.frames(), found.registration, self.playback, self.playback.tracker.rate_hz)
        offset_s = found.report.numbers["time_offset_orientation_s"].value
        note = (
            f"{self.task.capture.name} was registered with {self.clip}: its clock is {offset_s:.4f} s ahead, and "
            "methods received the room and mounts that were found; in the simulation they received the true ones."
        )
        return replace(take, notes=(note,))

    @cached_property
    def fitted(self) -> Scenario:
        """The scenario of the simulated side: that of the playback with the errors of the unit."""
        if self.task.unit is None:
            return self.playback.scenario
        return replace(self.playback.scenario, physics=None).change(self.task.unit, "unit")

    @cached_property
    def _noise(self) -> Noise:
        return self.fitted.disturbed_noise

    def _identity(self, seed: int) -> dict[str, Any]:
        """What tells the cells of one seed apart from others."""
        tracker = self.fitted.device.as_dict()
        return {"seed": seed, "noise": asdict(self._noise), "tracker": tracker, "span_s": self._span_s}

    def _simulate(self, seed: int) -> ObservedTake:
        """A simulation of the same take, scored from the first frame that the device has to its last.

        The seed of its errors is derived from the plan's, so that a capture of a simulated line with the same seed has
        other errors.
        """
        playback, tracker = self.playback, self.fitted.device
        mounts, drawn = playback.clip_evaluation.session.true_mounts, int(generator(seed, "trust").integers(2**62))
        found = simulate_tracker(playback.body, playback.take, mounts, tracker, self._noise, seed=drawn)
        first, last = (time_s * tracker.rate_hz for time_s in self._span_s)
        rows: Ints = np.flatnonzero((found.frame_index >= first - 0.5) & (found.frame_index <= last + 0.5))
        return ObservedTake(
            playback.clip_evaluation,
            playback.take,
            found.frames,
            playback.calibration,
            (LoopFrames(rows, found.frame_index[rows]),),
            sampling_times_s(playback.take.duration_s, tracker, len(mounts)),
            tracker.rate_hz,
            overload=tracker.overload,
        )

    @cached_property
    def _span_s(self) -> tuple[float, float]:
        """Times of the first and the last true frame of the device in the take [s]."""
        take = self.device
        expected = [loop.expected for loop in take.loops]
        return min(each[0] for each in expected) / take.rate_hz, max(each[-1] for each in expected) / take.rate_hz

    @cached_property
    def _evaluations(self) -> list[tuple[dict[str, Any], ClipEvaluation]]:
        """The evaluation for each combination of parameters, which differ in what methods learn."""
        base = self.playback.clip_evaluation
        if not self.task.parameters:
            return [({}, base)]
        scenario = replace(base.scenario, vary=dict(self.task.parameters))
        return [
            (values, ClipEvaluation(variant, base.source, base.part, base.behaviour))
            for values, variant in scenario.variants()
        ]

    def _cells(
        self, side: str, identity: Mapping[str, Any], load: Callable[[], ObservedTake]
    ) -> dict[str, dict[str, float | None]]:
        """Arm -> metric -> error of one side; arms that fail are left out and named in `failures`."""
        found = {}
        for arm in self.task.arms:
            try:
                found[str(arm)] = self._cell(arm, side, identity, load)
            except (Exception, SystemExit) as error:  # a method may raise anything: its cell alone fails
                self.failures[f"{arm} on {self.clip}, {side}"] = describe_failure(error)
        return found

    def _cell(
        self, arm: Arm, side: str, identity: Mapping[str, Any], load: Callable[[], ObservedTake]
    ) -> dict[str, float | None]:
        method = resolve_method(arm.method, DEFAULT_ISOLATION)
        evaluation = next(each for values, each in self._evaluations if values == arm.values)
        conditions = evaluation.conditions_of(method, "pos+ori")
        content = {"conditions": conditions, "seen": arm.stations, "metrics": self.task.metrics, **identity}
        path = (
            self.task.out
            / "cells"
            / f"{cell_key(content, NamedMethod(arm.method, method).identity, source_hash())}.json"
        )
        cell = {"key": path.stem, "arm": str(arm), "clip": str(self.clip), "side": side}
        if path.is_file():
            return read_cell_errors(path, cell, self.task.metrics)
        found = evaluate(
            method,
            arm.method,
            load(),
            stations=arm.stations,
            learnt_from=evaluation,
            metrics=self.task.metrics,
        )
        self.methods_s += found.seconds
        errors = {metric: found.metrics[metric] for metric in self.task.metrics}
        with named_folder_fault(self.task.out):
            write_result_json(path, {**cell, "errors": errors})
        return errors


def read_cell_errors(path: Path, cell: Mapping[str, Any], metrics: Sequence[str]) -> dict[str, float | None]:
    """Metric -> error of a finished cell; BadFile when it is damaged, edited, another cell's or of other metrics.

    `cell` has the entries that tell the cell apart: key, arm, clip and side.
    """
    content = read_result_json(path, _EXPECTED, _ADVICE)
    for name, value in cell.items():
        check_key(path, content.get(name), value, _EXPECTED, _ADVICE)
    errors = content.get("errors")
    if not isinstance(errors, dict) or set(errors) != set(metrics):
        raise BadFile(path, "errors of other metrics", _EXPECTED, _ADVICE)
    for value in errors.values():
        if value is not None and not (isinstance(value, float) and np.isfinite(value)):
            raise BadFile(path, f"an error of {value!r}", _EXPECTED, _ADVICE)
    return errors
