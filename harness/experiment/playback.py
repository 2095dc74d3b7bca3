"""A scenario's clip, or its performer standing model for a calibration, made ready to be worn outside a run: played by
an emulator, tracked live, or recorded."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np

from harness.body import humanoid
from harness.body.humanoid import Body
from harness.body.mounts import Mount
from harness.calibrate.calibration_file import CalibrationFile
from harness.calibrate.poses import POSES, configuration
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.core.split import ClipPart
from harness.errors import BadInput, UnknownName
from harness.experiment.cells import check_names, open_scenario_motion
from harness.experiment.clip_evaluation import ClipEvaluation, mounts_of, noise_of, tracker_of
from harness.experiment.scenario import Scenario, expand_clips, load_scenario
from harness.experiment.simulated_calibration import PerformerCalibration
from harness.simulate.loop import simulate_loop
from harness.simulate.simulation import Simulation, TrackerConfig
from harness.stream.codec.samples import DeviceSamples


class Playback:
    """One clip of a scenario with some of its stations, or with `posing` the poses of a calibration, held before it in
    the same session of the tracker; each part is made when it is first asked for."""

    def __init__(self, setting: ClipEvaluation, *, posing: bool = False) -> None:
        self.clip_evaluation, self.posing = setting, posing

    @property
    def scenario(self) -> Scenario:
        """As asked for: stations, rate and noise are put in."""
        return self.clip_evaluation.scenario

    @property
    def tracker(self) -> TrackerConfig:
        return tracker_of(self.scenario)

    @property
    def body(self) -> Body:
        """The performer's, in truth."""
        return self.clip_evaluation.body

    @property
    def mounts(self) -> tuple[Mount, ...]:
        """Where the stations are said to be worn."""
        return mounts_of(self.scenario)

    @property
    def performer_calibration(self) -> PerformerCalibration:
        """What methods are told of trackers, room and body: the truth, until somebody calibrates."""
        return self.clip_evaluation.performer_calibration

    @property
    def calibration(self) -> Calibration:
        """Of the trackers and the room, as methods are told."""
        return self.performer_calibration.calibration

    def with_calibration(self, kept: CalibrationFile) -> "Playback":
        """The same with methods told what a calibration found, for these stations; BadInput when it lacks one.

        Where it has no skeleton the body is the scenario's.
        """
        chosen = kept.select(tuple(self.scenario.stations))
        body = self.body if chosen.skeleton is None else humanoid.build_body(chosen.skeleton)
        calibrated = PerformerCalibration(chosen.calibration, body, {})
        return Playback(self.clip_evaluation.with_calibration(calibrated), posing=self.posing)

    @cached_property
    def take(self) -> BodyMotion:
        """What the performer does."""
        if not self.posing:
            return self.clip_evaluation.subject.take
        how = self.scenario.calibrating
        poses = [configuration(pose, self.body.skeleton) for pose in POSES]
        return self.clip_evaluation.session.make_pose_take(
            poses, miss_rad=float(np.deg2rad(how.miss_deg)), hold_s=how.hold_s
        )

    @cached_property
    def simulation(self) -> Simulation:
        """The first lap as a run of the scenario sees it, with the truth."""
        return self.clip_evaluation.session.observe(self.take) if self.posing else self.clip_evaluation.simulation

    @cached_property
    def samples(self) -> DeviceSamples:
        """What the device says, lap after lap; in the first one, until it turns back, just what `simulation` says."""
        session, scenario = self.clip_evaluation.session, self.scenario
        noise = scenario.disturbance.add_to(noise_of(scenario), tuple(scenario.stations))
        noise, name = (session.calibration_noise, session.name) if self.posing else (noise, "")
        return simulate_loop(
            self.body, self.take, session.true_mounts, self.tracker, noise, seed=scenario.seed, session=name
        )


def prepare_playback(
    scenario: Path | str,
    *,
    clip: str | None = None,
    stations: int | Sequence[str] | None = None,
    rate_hz: float | None = None,
    noise: str | None = None,
    seed: int | None = None,
    folder: Path | None = None,
    posing: bool = False,
) -> Playback:
    """A clip of a scenario (its first by default), with the first so many of its stations or those that are named.

    What is not given is as the scenario has it, but for the calibration: `exact`, until somebody calibrates.
    UnknownName, BadFile and BadInput as for a run of the scenario.
    """
    asked = expand_clips(load_scenario(scenario), folder)
    asked = replace(asked, stations=asked.worn_stations, worn=())
    if stations is not None:
        asked = replace(asked, stations={name: asked.stations[name] for name in select_stations(asked, stations)})
    if rate_hz is not None:
        asked = replace(asked, tracker=replace(asked.tracker, rate_hz=rate_hz))
    if noise is not None:
        asked = replace(asked, noise=noise)  # type: ignore[arg-type]  # `noise_of` refuses other names
    if seed is not None:
        asked = replace(asked, seed=seed)
    asked = replace(asked, vary={}, inputs=("pos+ori",), calibration="exact")
    part = ClipPart.parse(clip or asked.motion.test[0])
    source = open_scenario_motion(asked.motion, folder, asked.seed)
    check_names([replace(asked, motion=replace(asked.motion, test=(str(part),)))], folder)
    return Playback(
        ClipEvaluation(asked, source, part, _behaviour(asked, part) or source.behaviour(part.clip)), posing=posing
    )


def select_stations(scenario: Scenario, stations: int | Sequence[str]) -> Sequence[str]:
    """Names of the first so many stations of a scenario, or of those named; BadInput, UnknownName."""
    names = list(scenario.worn_stations)
    if isinstance(stations, int):
        if not 1 <= stations <= len(names):
            raise BadInput(f"{stations} stations of {len(names)}.", f"{scenario.name} has: {', '.join(names)}.")
        return names[:stations]
    for name in stations:
        if name not in names:
            raise UnknownName("station", name, names)
    return stations


def _behaviour(scenario: Scenario, part: ClipPart) -> str:
    """What a test clip shows; "" for a clip that the scenario does not judge."""
    tested, behaviours = scenario.motion.test, scenario.motion.behaviours
    if str(part) not in tested:
        return ""
    return behaviours[tested.index(str(part))] if len(behaviours) > 1 else behaviours[0]
