"""Playback of a scenario outside a run, for the emulator, a live session or a recording.

It plays a clip, or the calibration poses of the performer.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np

from harness.body import Body, Mount, build_body
from harness.calibrate import POSES, CalibrationFile, pose_configuration
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.core.split import ClipPart
from harness.errors import BadInput, UnknownName, shorten
from harness.experiment.clip_evaluation import ClipEvaluation
from harness.experiment.plan import check_names
from harness.experiment.scenarios.motion_source import expand_clips, open_scenario_motion
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.experiment.simulated_calibration import PerformerCalibration
from harness.mocap import LibraryFolders
from harness.simulate import Simulation, TrackerConfig, simulate_loop
from harness.stream.polhemus.codec import DeviceSamples


class Playback:
    """Playback of one clip of a scenario with some of its stations; each part is made when it is first needed.

    With `posing` it plays the calibration poses, which are held before the clip in the same session of the tracker.
    `performer` is the clip's, where somebody named the clip and its performer is known.
    """

    def __init__(self, setting: ClipEvaluation, *, posing: bool = False, performer: str = "") -> None:
        self.clip_evaluation, self.posing, self.performer = setting, posing, performer

    @property
    def scenario(self) -> Scenario:
        """The scenario with the chosen stations, rate and noise."""
        return self.clip_evaluation.scenario

    @property
    def tracker(self) -> TrackerConfig:
        return self.scenario.device

    @property
    def body(self) -> Body:
        """The performer's true body."""
        return self.clip_evaluation.body

    @property
    def mounts(self) -> tuple[Mount, ...]:
        """Nominal mounts of the stations."""
        return self.scenario.nominal_mounts

    @property
    def performer_calibration(self) -> PerformerCalibration:
        """The calibration that methods receive: exact, unless `with_calibration` gave another."""
        return self.clip_evaluation.performer_calibration

    @property
    def calibration(self) -> Calibration:
        """Calibration of trackers and room that methods receive."""
        return self.performer_calibration.calibration

    def with_calibration(
        self, kept: CalibrationFile, *, named: bool = False, say: Callable[[str], None] = lambda line: None
    ) -> "Playback":
        """A copy of the playback with a stored calibration. If it has no skeleton, the body is the scenario's.

        BadInput when it lacks one of the stations, and when it has others that are not worn, unless the user or the
        device named the stations (`named`). `say` receives both lists where they differ, and both performers.
        """
        stations = tuple(self.scenario.stations)
        chosen = kept.select(stations)
        if difference := kept.difference(stations):
            if not named and len(stations) < len(kept.calibration.stations):
                advice = f"Name what is worn, such as --stations {','.join(kept.calibration.stations)}."
                raise BadInput(f"{difference[0].upper()}{difference[1:]}.", advice)
            say(difference)
        if kept.performer and self.performer and kept.performer != self.performer:
            who = shorten(f"the calibration is of performer {kept.performer}; {self.clip_evaluation.part} is of")
            say(f"{who} {self.performer}")
        body = self.body if chosen.skeleton is None else build_body(chosen.skeleton)
        calibrated = PerformerCalibration(chosen.calibration, body, {})
        evaluation = self.clip_evaluation.with_calibration(calibrated)
        return Playback(evaluation, posing=self.posing, performer=self.performer)

    @cached_property
    def take(self) -> BodyMotion:
        """The motion that is played."""
        if not self.posing:
            return self.clip_evaluation.subject.take
        how = self.scenario.calibrating
        poses = [pose_configuration(pose, self.body.skeleton) for pose in POSES]
        return self.clip_evaluation.session.make_pose_take(
            poses, miss_rad=float(np.deg2rad(how.miss_deg)), hold_s=how.hold_s
        )

    @cached_property
    def simulation(self) -> Simulation:
        """Simulation of the first loop, as a run of the scenario has it, with the truth."""
        return self.clip_evaluation.session.observe(self.take) if self.posing else self.clip_evaluation.simulation

    @cached_property
    def reach_m(self) -> float:
        """Largest coordinate of any station in the tracker's frame during the motion [m]."""
        return self.samples.reach_m

    @cached_property
    def samples(self) -> DeviceSamples:
        """Samples of the device, loop after loop. The first loop equals `simulation` until the motion turns back."""
        session, scenario = self.clip_evaluation.session, self.scenario
        noise = scenario.disturbed_noise
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
    folder: LibraryFolders | None = None,
    posing: bool = False,
) -> Playback:
    """Prepare the playback of a clip of a scenario, by default its first test clip.

    `stations` is a number of stations or their names. Other values are the scenario's, except that the calibration is
    exact. UnknownName, BadFile and BadInput as for a run of the scenario.
    """
    asked = expand_clips(load_scenario(scenario), folder)
    asked = replace(asked, stations=asked.worn_stations, worn=())
    if stations is not None:
        asked = replace(asked, stations={name: asked.stations[name] for name in select_stations(asked, stations)})
    if rate_hz is not None:
        asked = replace(asked, tracker=replace(asked.tracker, rate_hz=rate_hz))
    if noise is not None:
        asked = replace(asked, noise=noise)  # type: ignore[arg-type]  # `Scenario.noise_model` refuses other names
    if seed is not None:
        asked = replace(asked, seed=seed)
    asked = replace(asked, vary={}, inputs=("pos+ori",), calibration="exact")
    part = ClipPart.parse(clip or asked.motion.test[0])
    source = open_scenario_motion(asked.motion, folder, asked.seed)
    check_names([replace(asked, motion=replace(asked.motion, test=(str(part),)))], folder)
    evaluation = ClipEvaluation(asked, source, part, _behaviour(asked, part) or source.behaviour(part.clip))
    return Playback(evaluation, posing=posing, performer=source.performer(part.clip) if clip else "")


def select_stations(scenario: Scenario, stations: int | Sequence[str]) -> Sequence[str]:
    """Names of the first `stations` stations of a scenario, or the given names. BadInput, UnknownName."""
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
    """Behaviour of a test clip; "" for a clip that is none of the scenario's test clips."""
    return dict(scenario.motion.tested).get(str(part), "")
