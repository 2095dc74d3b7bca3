"""What the cells of one clip share: the body, the true motion on it, its simulation, and what may be learnt from."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from functools import cached_property, lru_cache

import numpy as np

from harness.body import humanoid, retargeting
from harness.body.mounts import Mount, locate_mount
from harness.calibrate.skeleton_prior import fit_skeleton_prior
from harness.core.fields import replace_fields
from harness.core.humanoid24 import BONES, standard_skeleton
from harness.core.motion import BodyMotion, Clip
from harness.core.seeds import generator
from harness.core.skeleton import Skeleton
from harness.core.split import ClipPart, allowed_frames, refuse_leak, select_examples
from harness.errors import BadInput
from harness.experiment.scenario import Scenario
from harness.experiment.simulated_calibration import (
    PerformerCalibration,
    TrackerSession,
    simulate_poses_calibration,
    simulate_tpose_calibration,
    use_exact_calibration,
)
from harness.mocap.sources import MotionSource
from harness.reconstruct import registry
from harness.reconstruct.contract import Method, Reconstructor
from harness.results import manifest, storage
from harness.score.metrics import VERSIONS
from harness.score.score import WARM_UP_S
from harness.simulate import noise as noises
from harness.simulate.mounting import perturb_mounts
from harness.simulate.noise import Noise
from harness.simulate.simulation import Simulation, TrackerConfig, simulate_tracker
from harness.simulate.trajectory import Trajectory


def mounts_of(scenario: Scenario) -> tuple[Mount, ...]:
    """Where the stations are said to be worn."""
    return tuple(
        Mount(name, s.bone, s.along, float(np.deg2rad(s.around_deg)), s.stand_off_m)
        for name, s in scenario.worn_stations.items()
    )


def tracker_of(scenario: Scenario) -> TrackerConfig:
    """The device; sampling in turn belongs to the clock's errors, so that at level `clean` all stations are sampled
    at one moment unless the scenario's `tracker.slot_s` says otherwise (docs/is900.md 13.5)."""
    together = scenario.noise == "clean" and scenario.tracker.slot_s is None
    return replace(scenario.tracker, slot_s=0.0) if together else scenario.tracker


def noise_of(scenario: Scenario) -> Noise:
    """The level, with the scenario's changes to single components; UnknownName, BadInput."""
    try:
        return replace_fields(noises.noise_preset(scenario.noise), scenario.components, "components")
    except TypeError as error:
        raise BadInput(f"{error}.", "`harness.simulate.noise` says what each component takes.") from error


class ClipEvaluation:
    """One test clip of a scenario; each part is made when it is first asked for."""

    def __init__(self, scenario: Scenario, source: MotionSource, part: ClipPart, behaviour: str) -> None:
        self.scenario, self.source, self.part, self.behaviour = scenario, source, part, behaviour
        self.clip = source.load(part.clip)
        self._retargeted: dict[str, retargeting.RetargetReport] = {}
        """What each clip that is not on its own body lost on the way."""
        self._fitted: dict[str, Reconstructor] = {}
        self._sources: dict[str, str] = {}

    def with_conditions(self, scenario: Scenario) -> "ClipEvaluation | None":
        """The same under other errors of the tracker, with other stations, calibrated otherwise or for other methods,
        sharing motion and, on the same body, what was learnt, which knows of none of these; None if more differs."""
        world = ("noise", "profile", "components", "disturbance", "stations", "worn", "calibration", "calibrating")
        free = (*world, "methods", "inputs", "vary")
        if replace(self.scenario, **{name: getattr(scenario, name) for name in free}) != scenario:
            return None
        other = copy.copy(self)
        other.scenario = scenario
        if "poses" in (self.scenario.calibration, scenario.calibration):  # another skeleton, and all that stood on it
            other._fitted = {}
            other._retargeted = {name: r for name, r in self._retargeted.items() if name == self.clip.name}
            other.__dict__.pop("examples", None)
        for own in ("session", "performer_calibration", "simulation", "_worn", "_same_for_all"):
            other.__dict__.pop(own, None)
        return other

    def with_calibration(self, calibrated: PerformerCalibration) -> "ClipEvaluation":
        """The same with methods told this of trackers, room and body; what was learnt on another body is not shared."""
        other = copy.copy(self)
        other.__dict__.pop("examples", None)
        other.__dict__["performer_calibration"] = calibrated
        other._fitted, other._retargeted = {}, {}
        return other

    def fit_method(self, method: Method, name: str) -> Reconstructor:
        """The method of that name, trained once on what the split lets it see."""
        if name not in self._fitted:
            rng = generator(self.scenario.seed, "method", registry.without_options(name))
            examples = self.examples if method.needs_examples else []
            self._fitted[name] = method.fit(self.performer_calibration.body, examples, rng)
        return self._fitted[name]

    @cached_property
    def session(self) -> TrackerSession:
        """What is true while the trackers are worn."""
        scenario, how, nominal = self.scenario, self.scenario.calibrating, mounts_of(self.scenario)
        turned_rad, name = float(np.deg2rad(how.turned_deg)), str(self.part)
        worn = perturb_mounts(nominal, beside_m=how.beside_m, turned_rad=turned_rad, seed=scenario.seed, session=name)
        tracker, noise = tracker_of(scenario), noise_of(scenario)
        return TrackerSession(name, scenario.seed, self.body, nominal, worn, tracker, noise)

    @cached_property
    def performer_calibration(self) -> PerformerCalibration:
        """What methods go by; NotStanding when the performer's model cannot be calibrated from."""
        how = self.scenario.calibrating
        model = {"miss_rad": float(np.deg2rad(how.miss_deg)), "hold_s": how.hold_s}
        match self.scenario.calibration:
            case "exact":
                return use_exact_calibration(self.session)
            case "tpose":
                return simulate_tpose_calibration(self.session, **model)
            case "poses":
                known = f"{len(self.people)} others ({self.source.title})"
                return simulate_poses_calibration(
                    self.session, fit_skeleton_prior(list(self.people.values()), source=known), **model
                )

    @cached_property
    def people(self) -> dict[str, Skeleton]:
        """Of whose bones something is known before eight poses are held: never the performer's own."""
        return self.source.other_skeletons(without=self.source.subject(self.part.clip))

    @cached_property
    def body(self) -> humanoid.Body:
        """The performer's, in truth."""
        if self.scenario.motion.body == "own":
            return humanoid.build_body(self.clip.skeleton.subset(BONES)[0])
        return humanoid.build_body(standard_skeleton())

    @cached_property
    def full_take(self) -> BodyMotion:
        """The test clip on the performer's body."""
        return self._on_body(self.clip, self.body)

    @cached_property
    def take(self) -> BodyMotion:
        """The part of it that is judged, and before a part the second of warm-up, which is nobody's example either."""
        frames, rate_hz = self.part.frames(len(self.full_take)), self.full_take.rate_hz
        start = max(frames.start - round(WARM_UP_S * rate_hz), 0)
        longest_s = self.scenario.motion.longest_s
        stop = min(frames.stop, start + round(longest_s * rate_hz) + 1) if longest_s else frames.stop
        return _cut_take(self.full_take, range(start, stop), str(self.part))

    @cached_property
    def simulation(self) -> Simulation:
        scenario, tracker = self.scenario, self.session.tracker
        noise = scenario.disturbance.add_to(self.session.noise, tuple(scenario.worn_stations))
        seen = simulate_tracker(self.body, self.take, self.session.true_mounts, tracker, noise, seed=scenario.seed)
        if len(seen.truth_s) <= WARM_UP_S * tracker.rate_hz:
            found = f"{self.part} is judged for {len(seen.truth_s) / tracker.rate_hz:.2f} s"
            raise BadInput(f"{found}, all of it warm-up, which no score counts.", f"Take more than {WARM_UP_S:g} s.")
        return seen

    @cached_property
    def held_out_parts(self) -> tuple[ClipPart, ...]:
        """What nothing is learnt from: the part that is judged, and what the scenario withholds."""
        return (self.part, *map(ClipPart.parse, self.scenario.motion.withheld))

    @cached_property
    def example_names(self) -> list[str]:
        """The clips that the split and the scenario let a method learn from, wholly or in part."""
        motion, test = self.scenario.motion, self.part
        subjects = {name: self.source.subject(name) for name in {*motion.examples, test.clip}}
        names = select_examples(test, motion.examples, motion.split, subjects)
        if motion.database == "behaviour":
            names = [name for name in names if self.source.behaviour(name) == self.behaviour]
        return [name for name in names if ClipPart(name) not in self.held_out_parts]

    @cached_property
    def performer(self) -> str:
        """`known` if other motion of whoever is judged is among the examples, `new` if not, "" without examples."""
        if not self.example_names:
            return ""
        judged = self.source.subject(self.part.clip)
        return "known" if judged in {self.source.subject(name) for name in self.example_names} else "new"

    @cached_property
    def example_clips(self) -> list[Clip]:
        test = self.part
        clips, judged = [self.source.load(name) for name in self.example_names], _motion_digest(self.clip)
        for clip in clips:
            if clip.name != test.clip and _motion_digest(clip) == judged:
                raise BadInput(f"{clip.name} is {test.clip} under another name.", "Remove it from motion.examples.")
        return clips

    @cached_property
    def examples(self) -> list[BodyMotion]:
        """What the split lets a method learn from, on the body that it goes by and at the tracker's rate."""
        takes, body = [], self.performer_calibration.body
        for clip in self.example_clips:
            runs = allowed_frames(self.held_out_parts, clip.name, len(clip), clip.rate_hz)
            refuse_leak(self.held_out_parts, clip.name, runs, len(clip), clip.rate_hz)
            whole = self._on_body(clip, body)
            takes += [_resample(body, _cut_take(whole, r, clip.name), self.scenario.tracker.rate_hz) for r in runs]
        return thin_takes(takes, self.scenario.motion.thin_to)

    def conditions_of(self, method: Method, inputs: str) -> dict[str, object]:
        """Everything that defines a cell; two results with other inputs are not comparable.

        Device and noise stand as numbers, motion, body and mounts as digests of theirs: names and defaults mean
        what the code of their day made of them.
        """
        learnt = {c.name: _motion_digest(c) for c in (self.example_clips if method.needs_examples else [])}
        return {
            **self._same_for_all,
            "examples": learnt,
            "withheld": sorted(str(part) for part in self.held_out_parts[1:] if part.clip in learnt),
            "inputs": inputs,
        }

    @cached_property
    def _same_for_all(self) -> dict[str, object]:
        """Of the inputs, what all methods share."""
        scenario = self.scenario
        content = asdict(scenario)
        for many in ("methods", "inputs", "name", "components", "vary", "expected_order", "left_out", "fault", "worn"):
            del content[many]
        content["stations"] = {name: asdict(station) for name, station in scenario.worn_stations.items()}
        del content["motion"]["test"], content["motion"]["behaviours"], content["motion"]["examples"]
        del content["motion"]["withheld"]
        if scenario.calibration == "exact":
            del content["calibrating"]  # nobody stands model, and where trackers sit is in the digest of the mounts
        return {
            **content,
            "tracker": asdict(tracker_of(scenario)),
            "components": asdict(noise_of(scenario)),
            "disturbance": scenario.disturbance.as_dict(),
            "clip": str(self.part),
            "motion_digest": _motion_digest(self.clip),
            **self._worn,
            **({"people_digest": self._people_digest} if scenario.calibration == "poses" else {}),
            "metric_versions": VERSIONS,
        }

    @cached_property
    def _worn(self) -> dict[str, str]:
        """Digests of the body and of where the stations really sit on it."""
        skeleton = self.body.skeleton
        worn = [array for mount in self.session.true_mounts for array in locate_mount(skeleton, mount)]
        body = storage.digest(skeleton.bone_m, skeleton.axes, self.body.limits_rad)
        return {"body_digest": body, "mounts_digest": storage.digest(*worn)}

    @cached_property
    def _people_digest(self) -> str:
        return storage.digest(*(skeleton.bone_m for skeleton in self.people.values()))

    def notes(self, method: Method) -> tuple[str, ...]:
        """What a reader should know: notes of the clip, what was calibrated, what retargeting to another body cost."""
        used = [self.clip, *(self.example_clips if method.needs_examples else [])]
        reports = [self._retargeted[clip.name] for clip in used if clip.name in self._retargeted]
        told = (*self.clip.notes, *self.performer_calibration.notes)
        if not reports:
            return told
        deviation_mm = np.mean([report.deviation_mm for report in reports])
        worst = max(reports, key=lambda report: report.deviation_mm)
        soles_mm = [x for report in reports for x in (report.float_mm, report.sink_mm) if np.isfinite(x)]
        how = ", every angle kept" if self.scenario.motion.body == "common" else ""
        note = (
            f"{len(reports)} of {len(used)} clips (test and examples) retargeted to the body under test{how}: joint "
            f"centres {deviation_mm:.0f} mm off on average, {worst.deviation_mm:.0f} mm in {worst.clip}"
        )
        soles = f"; soles in stance off by up to {max(soles_mm):.0f} mm (95th percentile)" if soles_mm else ""
        return (*told, note + soles)

    def key(self, method: Method, name: str, inputs: str, varied: Mapping[str, object]) -> str:
        """Of a cell; the varied values count even where they change nothing for the method, as does what the scenario
        is called, for a cell says both."""
        if name not in self._sources:
            self._sources[name] = registry.source_hash(method)
        described = {"name": name, "options": repr(method), "source": self._sources[name]}
        content = {**self.conditions_of(method, inputs), "varied": varied, "scenario": self.scenario.name}
        return storage.cell_key(content, described, manifest.source_hash())

    def _on_body(self, clip: Clip, body: humanoid.Body) -> BodyMotion:
        kind = self.scenario.motion.body
        if clip.name == self.clip.name and kind == "own" and body is self.body:
            return retargeting.retarget_to_own_body(clip)[1]
        if kind == "own" or body is not self.body:
            take, report = _retarget(clip, kind, body.skeleton)
        else:
            take, report = _retarget_to_standard(clip, kind)
        self._retargeted[clip.name] = report
        return take


@lru_cache(maxsize=256)
def _retarget_to_standard(clip: Clip, kind: str) -> tuple[BodyMotion, retargeting.RetargetReport]:
    """The same for every test clip: once in a process."""
    return _retarget(clip, kind, standard_skeleton())


def _retarget(clip: Clip, kind: str, skeleton: Skeleton) -> tuple[BodyMotion, retargeting.RetargetReport]:
    onto = retargeting.retarget_with_same_angles if kind == "common" else retargeting.retarget_to_common_body
    return onto(clip, skeleton)


@lru_cache(maxsize=256)
def _motion_digest(clip: Clip) -> str:
    skeleton = clip.skeleton
    where = np.array([clip.rate_hz]), skeleton.bone_m, skeleton.axes
    return storage.digest(*where, clip.root_m, clip.world_from_root, clip.angles_rad)


def _cut_take(take: BodyMotion, frames: range, name: str) -> BodyMotion:
    return BodyMotion(
        name, take.subject, take.source, take.behaviour, take.rate_hz, take.qpos[frames.start : frames.stop]
    )


def thin_takes(takes: Sequence[BodyMotion], count: int) -> list[BodyMotion]:
    """So many frames of takes at one rate, evenly spaced over all of them, at the lower rate that they then have.

    0 keeps all; BadInput when there are not as many.
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


def _resample(body: humanoid.Body, take: BodyMotion, rate_hz: float) -> BodyMotion:
    """The take at the tracker's rate, on the same smooth trajectory that the simulation samples."""
    trajectory = Trajectory(body, take)
    time_s = np.arange(0.0, trajectory.duration_s, 1.0 / rate_hz)
    return BodyMotion(take.name, take.subject, take.source, take.behaviour, rate_hz, trajectory.qpos(time_s))
