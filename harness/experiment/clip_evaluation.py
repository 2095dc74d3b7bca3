"""The evaluation of one test clip, in three records by lifetime: the subject, the training and the observation.

Cells of one clip share them by construction: variants of a scenario hold the same subject, and methods and inputs the
same observation.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Self

import numpy as np

from harness.body import (
    Body,
    RetargetReport,
    build_body,
    locate_mount,
    retarget_to_common_body,
    retarget_to_own_body,
    retarget_with_same_angles,
)
from harness.calibrate import SkeletonPrior, fit_skeleton_prior
from harness.core.files import digest
from harness.core.humanoid24 import select_bones, standard_skeleton
from harness.core.motion import BodyMotion, Clip, count_steps
from harness.core.seeds import generator
from harness.core.skeleton import Skeleton
from harness.core.split import ClipPart, ExampleLeak, allowed_frames, forbidden_frames, refuse_leak, select_examples
from harness.core.stream_health import describe_grown_room, poor_hearing
from harness.errors import BadInput
from harness.experiment.example_subset import keep_share
from harness.experiment.methods.remote_method import NamedMethod
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_motion import ScenarioMotion
from harness.experiment.simulated_calibration import (
    PerformerCalibration,
    TrackerSession,
    simulate_kim2012_calibration,
    simulate_liu2011_calibration,
    simulate_poses_calibration,
    simulate_tpose_calibration,
    use_exact_calibration,
)
from harness.mocap import MotionSource, find_shared_motion
from harness.reconstruct import Method, Reconstructor, without_options
from harness.results import cell_key, source_hash
from harness.score import VERSIONS, WARM_UP_S
from harness.simulate import Simulation, Trajectory, perturb_mounts, simulate_tracker


@dataclass(frozen=True, eq=False)
class Subject:
    """The test clip, its performer and body, the true motion on that body, and the clips that may be learnt from.

    All variants of a scenario that differ only in what trackers observe share one subject.
    """

    motion: ScenarioMotion
    seed: int
    rate_hz: float
    """Rate of the tracker, to which examples are resampled [Hz]."""
    source: MotionSource
    part: ClipPart
    behaviour: str

    @cached_property
    def clip(self) -> Clip:
        """The test clip as recorded."""
        return self.source.load(self.part.clip)

    @cached_property
    def people(self) -> dict[str, Skeleton]:
        """Skeletons of the other performers, from which the calibration with eight poses takes its prior."""
        return self.source.other_skeletons(without=self.source.subject(self.part.clip))

    @cached_property
    def body(self) -> Body:
        """The performer's true body."""
        if self.motion.body == "own":
            return build_body(select_bones(self.clip.skeleton)[0])
        return build_body(standard_skeleton())

    @cached_property
    def full_take(self) -> BodyMotion:
        """The whole test clip on the performer's body."""
        return self._retargeted[0]

    @property
    def retarget_report(self) -> RetargetReport | None:
        """Errors of retargeting the test clip; None on the performer's own proportions."""
        return self._retargeted[1]

    @cached_property
    def _retargeted(self) -> tuple[BodyMotion, RetargetReport | None]:
        return self.on_body(self.clip, self.body)

    def on_body(self, clip: Clip, body: Body) -> tuple[BodyMotion, RetargetReport | None]:
        """A clip on a body, and the errors of retargeting; None for the test clip on its performer's proportions."""
        kind = self.motion.body
        if clip.name == self.clip.name and kind == "own" and body is self.body:
            return retarget_to_own_body(clip)[1], None
        if kind == "own" or body is not self.body:
            return _retarget(clip, kind, body.skeleton)
        return _retarget_to_standard(clip, kind)

    @cached_property
    def take(self) -> BodyMotion:
        """The scored part of the test clip, and up to one second of warm-up before it.

        No method has learnt from that second, because the split guards it.
        """
        frames, rate_hz = self.part.frames(len(self.full_take)), self.full_take.rate_hz
        start = max(frames.start - round(WARM_UP_S * rate_hz), 0)
        longest_s = self.motion.longest_s
        stop = min(frames.stop, start + round(longest_s * rate_hz) + 1) if longest_s else frames.stop
        return _cut_take(self.full_take, range(start, stop), str(self.part))

    @cached_property
    def held_out_parts(self) -> tuple[ClipPart, ...]:
        """Parts of clips that nothing is learnt from: the scored part, and what the scenario withholds."""
        return (self.part, *map(ClipPart.parse, self.motion.withheld))

    @cached_property
    def example_names(self) -> list[str]:
        """Names of the clips that the split and the scenario let a method learn from, wholly or in part."""
        motion, test = self.motion, self.part
        subjects = {name: self.source.subject(name) for name in {*motion.examples, test.clip}}
        names = select_examples(test, motion.examples, motion.split, subjects)
        if motion.database == "behaviour":
            names = [name for name in names if self.source.behaviour(name) == self.behaviour]
        return [name for name in names if ClipPart(name) not in self.held_out_parts]

    @cached_property
    def performer(self) -> str:
        """`known` if the examples include other motion of the performer, `new` if not, "" without examples."""
        if not self.example_names:
            return ""
        performer = self.source.subject(self.part.clip)
        return "known" if performer in {self.source.subject(name) for name in self.example_names} else "new"

    @cached_property
    def example_clips(self) -> list[Clip]:
        """The example clips; ExampleLeak when one contains motion of the test clip under any name."""
        clips = [self.source.load(name) for name in self.example_names]
        for clip in clips:
            self._refuse_copy(clip)
        return clips

    def _refuse_copy(self, example: Clip) -> None:
        """Raise ExampleLeak if an example is the test clip, or shares a second of its motion, beyond what is cut."""
        tested = forbidden_frames(self.part, self.motion.split, len(self.clip), self.clip.rate_hz)
        runs = self.allowed_runs(example)
        if example.name != self.part.clip and _motion_digest(example) == _motion_digest(self.clip):
            shared = f"{example.name} is {self.part.clip} under another name."
        elif (found := find_shared_motion(self.clip, [tested], example, runs)) is not None:
            how = ", mirrored" if found.mirrored else ""
            tested_s, example_s = (f"{from_s:.1f} to {to_s:.1f} s" for from_s, to_s in (found.first_s, found.second_s))
            shared = f"{self.part} ({tested_s}) and its example {example.name} ({example_s}{how}) are the same motion."
        else:
            return
        advice = f"A test clip can never be among its own examples: remove {example.name} from motion.examples."
        raise ExampleLeak(shared, advice)

    def allowed_runs(self, example: Clip) -> list[range]:
        """The runs of an example's frames that a method may learn from."""
        return allowed_frames(self.held_out_parts, example.name, len(example), example.rate_hz)

    @cached_property
    def training(self) -> "Training":
        """Training on the performer's true body."""
        return Training(self, self.body)


@dataclass(frozen=True, eq=False)
class Training:
    """The examples of a subject on one body, and the methods that were fitted to them."""

    subject: Subject
    body: Body
    """The body that methods are given: the performer's, or the one that a calibration estimated."""
    _fits: dict[str, Reconstructor] = field(default_factory=dict)

    @cached_property
    def _retargeted(self) -> list[tuple[BodyMotion, RetargetReport | None]]:
        return [self.subject.on_body(clip, self.body) for clip in self.subject.example_clips]

    @property
    def retarget_reports(self) -> list[RetargetReport | None]:
        """Errors of retargeting each example clip."""
        return [report for _, report in self._retargeted]

    @cached_property
    def examples(self) -> list[BodyMotion]:
        """The motion that the split lets a method learn from, on the body and at the tracker's rate."""
        takes, held_out = [], self.subject.held_out_parts
        for clip, (whole_take, _) in zip(self.subject.example_clips, self._retargeted, strict=True):
            runs = self.subject.allowed_runs(clip)
            refuse_leak(held_out, clip.name, runs, len(clip), clip.rate_hz)
            parts = (_cut_take(whole_take, run, clip.name) for run in runs)
            takes += [_resample(self.body, part, self.subject.rate_hz) for part in parts]
        kept = keep_share(takes, self.subject.motion.example_share, self.subject.seed)
        return thin_takes(kept, self.subject.motion.thin_to)

    def fit(self, method: Method, name: str) -> Reconstructor:
        """The method of that name, fitted once to the examples."""
        if name not in self._fits:
            rng = generator(self.subject.seed, "method", without_options(name))
            examples = [replace(take) for take in self.examples] if method.needs_examples else []
            self._fits[name] = method.fit(self.body, examples, rng)
        return self._fits[name]


@dataclass(frozen=True, eq=False)
class Observation:
    """What the trackers of a scenario observe of a subject: the session, its calibration and the simulated stream."""

    scenario: Scenario
    subject: Subject

    @cached_property
    def session(self) -> TrackerSession:
        """The truth about one wearing of the trackers."""
        scenario, settings, nominal = self.scenario, self.scenario.calibrating, self.scenario.nominal_mounts
        turned_rad, name = float(np.deg2rad(settings.turned_deg)), str(self.subject.part)
        true_mounts = perturb_mounts(
            nominal, beside_m=settings.beside_m, turned_rad=turned_rad, seed=scenario.seed, session=name
        )
        tracker, noise = scenario.device, scenario.noise_model
        return TrackerSession(name, scenario.seed, self.subject.body, nominal, true_mounts, tracker, noise)

    @cached_property
    def calibration(self) -> PerformerCalibration:
        """The calibration that methods receive; UnusableHold when the held poses do not suffice for one."""
        settings = self.scenario.calibrating
        model = {"miss_rad": float(np.deg2rad(settings.miss_deg)), "hold_s": settings.hold_s}
        match self.scenario.calibration:
            case "exact":
                return use_exact_calibration(self.session)
            case "tpose":
                return simulate_tpose_calibration(self.session, **model)
            case "kim2012":
                return simulate_kim2012_calibration(self.session, **model)
            case "poses":
                return simulate_poses_calibration(self.session, self._skeleton_prior, **model)
            case "liu2011":
                return simulate_liu2011_calibration(self.session, self._skeleton_prior, **model)

    @property
    def _skeleton_prior(self) -> SkeletonPrior:
        """Prior of the performer's bones, from other people."""
        people = self.subject.people
        return fit_skeleton_prior(list(people.values()), source=f"{len(people)} others ({self.subject.source.title})")

    @cached_property
    def simulation(self) -> Simulation:
        """The stream of the take, and the truth; BadInput when the take is no longer than the warm-up."""
        scenario, tracker, take = self.scenario, self.session.tracker, self.subject.take
        noise = scenario.disturbed_noise
        mounts = self.session.true_mounts
        simulation = simulate_tracker(self.subject.body, take, mounts, tracker, noise, seed=scenario.seed)
        if len(simulation.truth_s) <= WARM_UP_S * tracker.rate_hz:
            found = f"{self.subject.part} has {len(simulation.truth_s) / tracker.rate_hz:.2f} s of motion"
            raise BadInput(f"{found}, all of it warm-up, which is not scored.", f"Take more than {WARM_UP_S:g} s.")
        return simulation

    @cached_property
    def conditions(self) -> dict[str, object]:
        """The conditions that all methods and inputs share, as JSON content."""
        scenario, subject = self.scenario, self.subject
        content, components = scenario.content(), asdict(scenario.noise_model)
        if (physics := components.pop("physics")) is not None:
            content["physics"] = physics  # with what the noise preset leaves out
        for key in ("methods", "inputs", "name", "components", "vary", "expected_order", "left_out", "fault", "worn"):
            del content[key]
        del content["unit"]  # it changes no result
        content["stations"] = {name: asdict(station) for name, station in scenario.worn_stations.items()}
        for key in ("test", "behaviours", "examples", "withheld"):
            del content["motion"][key]
        if scenario.motion.example_share == 1.0:
            del content["motion"]["example_share"]  # nothing is left out: the same as before the key was there
        if scenario.calibration == "exact":
            del content["calibrating"]  # no pose is held, and the digest of the mounts covers where trackers sit
        skeleton = subject.body.skeleton
        mounts = [array for mount in self.session.true_mounts for array in locate_mount(skeleton, mount)]
        with_prior = scenario.calibration in ("poses", "liu2011")
        return {
            **content,
            "tracker": scenario.device.as_dict(),
            "components": components,
            "disturbance": scenario.disturbance.as_dict(),
            "clip": str(subject.part),
            "motion_digest": _motion_digest(subject.clip),
            "body_digest": digest(skeleton.bone_m, skeleton.axes, subject.body.limits_rad),
            "mounts_digest": digest(*mounts),
            **({"people_digest": digest(*(p.bone_m for p in subject.people.values()))} if with_prior else {}),
            "metric_versions": VERSIONS,
        }


_OBSERVATION_KEYS = (
    *("noise", "profile", "components", "physics", "disturbance", "stations", "worn", "calibration", "calibrating"),
)
"""Scenario keys that only the observation depends on."""
_METHOD_KEYS = ("methods", "inputs", "vary")
"""Scenario keys that neither subject nor observation depends on."""


class ClipEvaluation:
    """One test clip of a scenario: its subject, its observation and the training of methods, each made when needed."""

    def __init__(self, scenario: Scenario, source: MotionSource, part: ClipPart, behaviour: str) -> None:
        subject = Subject(scenario.motion, scenario.seed, scenario.tracker.rate_hz, source, part, behaviour)
        self._set(scenario, subject, Observation(scenario, subject))

    def _set(
        self,
        scenario: Scenario,
        subject: Subject,
        observation: Observation,
        calibration: PerformerCalibration | None = None,
    ) -> Self:
        self.scenario, self.subject, self.observation = scenario, subject, observation
        self.source, self.part, self.behaviour = subject.source, subject.part, subject.behaviour
        self._calibration = calibration
        self._methods: dict[str, dict[str, str]] = {}
        return self

    def with_conditions(self, scenario: Scenario) -> "ClipEvaluation | None":
        """An evaluation of the same clip under another scenario, which shares what the two have in common.

        The subject, with training on its body, is shared when scenarios differ in the tracker's errors, stations,
        calibration, methods and inputs. The observation is shared when they differ in methods and inputs alone.
        None if anything else differs.
        """
        if _replace_keys(self.scenario, scenario, _METHOD_KEYS) == scenario:
            observation = self.observation
        elif _replace_keys(self.scenario, scenario, _METHOD_KEYS + _OBSERVATION_KEYS) == scenario:
            observation = Observation(scenario, self.subject)
        else:
            return None
        return object.__new__(ClipEvaluation)._set(scenario, self.subject, observation)

    def with_calibration(self, calibration: PerformerCalibration) -> "ClipEvaluation":
        """A copy of the evaluation in which methods receive another calibration."""
        return object.__new__(ClipEvaluation)._set(self.scenario, self.subject, self.observation, calibration)

    @property
    def body(self) -> Body:
        """The performer's true body."""
        return self.subject.body

    @property
    def session(self) -> TrackerSession:
        """The truth about one wearing of the trackers."""
        return self.observation.session

    @property
    def simulation(self) -> Simulation:
        """The simulated stream and the truth."""
        return self.observation.simulation

    @property
    def performer_calibration(self) -> PerformerCalibration:
        """The calibration that methods receive."""
        return self._calibration or self.observation.calibration

    @cached_property
    def training(self) -> Training:
        """The examples on the body that methods receive; shared with other evaluations of the true body."""
        body = self.performer_calibration.body
        return self.subject.training if body is self.subject.body else Training(self.subject, body)

    def fit_method(self, method: Method, name: str) -> Reconstructor:
        """The method of that name, trained once on what the split allows."""
        return self.training.fit(method, name)

    def conditions_of(self, method: Method, inputs: str) -> dict[str, object]:
        """Everything that defines a cell; two results with other conditions are not comparable.

        Device and noise stand as numbers, motion, body and mounts as digests, because names and defaults depend on
        the version of the code.
        """
        learnt = {c.name: _motion_digest(c) for c in (self.subject.example_clips if method.needs_examples else [])}
        return {
            **self.observation.conditions,
            "examples": learnt,
            "withheld": sorted(str(part) for part in self.subject.held_out_parts[1:] if part.clip in learnt),
            "inputs": inputs,
        }

    def notes(self, method: Method) -> tuple[str, ...]:
        """Notes for readers: on the clip, the calibration, the room of a physical tracker, and retargeting."""
        reports = [self.subject.retarget_report, *(self.training.retarget_reports if method.needs_examples else [])]
        known = [report for report in reports if report is not None]
        health = self.simulation.health
        room = filter(None, (poor_hearing(health), describe_grown_room(health)))
        notes = (*self.subject.clip.notes, *self.performer_calibration.notes, *room)
        if not known:
            return notes
        deviation_mm = np.mean([report.deviation_mm for report in known])
        worst = max(known, key=lambda report: report.deviation_mm)
        soles_mm = [x for report in known for x in (report.float_mm, report.sink_mm) if np.isfinite(x)]
        angles = ", every angle kept" if self.scenario.motion.body == "common" else ""
        note = (
            f"{len(known)} of {len(reports)} clips (test and examples) retargeted to the body under test{angles}: "
            f"joint centres {deviation_mm:.0f} mm off on average, {worst.deviation_mm:.0f} mm in {worst.clip}"
        )
        soles = f"; soles in stance off by up to {max(soles_mm):.0f} mm (95th percentile)" if soles_mm else ""
        return (*notes, note + soles)

    def key(self, method: Method, name: str, inputs: str, identity: Mapping[str, object]) -> str:
        """Key of a cell; `identity` is what else the cell states, see `PlannedCell`."""
        if name not in self._methods:
            self._methods[name] = NamedMethod(name, method).identity
        content = {**self.conditions_of(method, inputs), **identity}
        return cell_key(content, self._methods[name], source_hash())


def _replace_keys(scenario: Scenario, other: Scenario, keys: Sequence[str]) -> Scenario:
    return replace(scenario, **{key: getattr(other, key) for key in keys})


@lru_cache(maxsize=256)
def _retarget_to_standard(clip: Clip, kind: str) -> tuple[BodyMotion, RetargetReport]:
    """Retargeting to the standard skeleton. It is the same for every test clip, hence done once per process."""
    return _retarget(clip, kind, standard_skeleton())


def _retarget(clip: Clip, kind: str, skeleton: Skeleton) -> tuple[BodyMotion, RetargetReport]:
    onto = retarget_with_same_angles if kind == "common" else retarget_to_common_body
    return onto(clip, skeleton)


@lru_cache(maxsize=256)
def _motion_digest(clip: Clip) -> str:
    skeleton = clip.skeleton
    where = np.array([clip.rate_hz]), skeleton.bone_m, skeleton.axes
    return digest(*where, clip.root_m, clip.world_from_root, clip.angles_rad)


def _cut_take(take: BodyMotion, frames: range, name: str) -> BodyMotion:
    return BodyMotion(
        name, take.subject, take.source, take.behaviour, take.rate_hz, take.qpos[frames.start : frames.stop]
    )


def thin_takes(takes: Sequence[BodyMotion], count: int) -> list[BodyMotion]:
    """Keep `count` frames of takes at one rate, evenly spaced over all of them, and state their lower rate.

    A count of 0 keeps all frames. BadInput when there are fewer than `count`.
    """
    total = sum(map(len, takes))
    if not count:
        return list(takes)
    if not 0 < count <= total:
        raise BadInput(f"{count} frames are wanted of examples that have {total}.", "Change motion.thin_to.")
    every = total // count
    kept, out, passed = every // 2 + every * np.arange(count), [], 0
    for take in takes:
        rows = kept[(kept >= passed) & (kept < passed + len(take))] - passed
        passed += len(take)
        if len(rows):
            rate_hz = take.rate_hz / every
            out.append(BodyMotion(take.name, take.subject, take.source, take.behaviour, rate_hz, take.qpos[rows]))
    return out


def _resample(body: Body, take: BodyMotion, rate_hz: float) -> BodyMotion:
    """The take at the tracker's rate, on the same smooth trajectory that the simulation samples."""
    trajectory = Trajectory(body, take)
    count_steps(trajectory.duration_s, 1.0 / rate_hz, take.name)
    time_s = np.arange(0.0, trajectory.duration_s, 1.0 / rate_hz)
    return BodyMotion(take.name, take.subject, take.source, take.behaviour, rate_hz, trajectory.qpos(time_s))
