"""Guided calibration of a performer with the stations of a scenario: poses, their collection, and the solution."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Literal

from harness.body import Body, Mount, build_body
from harness.calibrate import (
    POSES,
    CalibrationFile,
    CalibrationOutcome,
    CalibrationPose,
    Notifier,
    PerformerPreview,
    PoseClassifier,
    PoseCollector,
    PoseDisplay,
    PoseGuide,
    SkeletonPrior,
    calibrate_poses,
    calibrate_tpose,
    fit_skeleton_prior,
    pose_configuration,
    report_pose_calibration,
    report_tpose_calibration,
)
from harness.core.arrays import Floats
from harness.core.package_data import VERSION
from harness.core.skeleton import Skeleton
from harness.core.split import ClipPart
from harness.experiment.playback import prepare_playback, select_stations
from harness.experiment.scenarios.motion_source import expand_clips, open_scenario_motion
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.mocap import LibraryFolders, MotionSource
from harness.stream import TrackerFrame

CalibrationKind = Literal["poses", "tpose"]


@dataclass(frozen=True, eq=False)
class CalibrationSession:
    """Calibration of a performer who wears stations of a scenario; UnknownName and BadFile as for a run of it."""

    scenario: Path | str
    stations: tuple[str, ...]
    """Station names in the order of the stream's rows."""
    kind: CalibrationKind = "poses"
    """`poses`: bones, mounts and room from eight poses; `tpose`: mounts and room from the first pose, known body."""
    clip: str | None = None
    """Clip of the performer. It gives the body for `tpose`, and `poses` excludes its performer from the prior.

    None stands for the scenario's first clip, or for a performer whom the prior does not contain.
    """
    folder: LibraryFolders | None = None
    """Library of real motion, if the scenario needs one."""
    skeleton: Skeleton | None = None
    """The performer's skeleton for `tpose`, where it is not that of the clip."""

    @cached_property
    def resolved_scenario(self) -> Scenario:
        """The scenario with these stations alone, in this order."""
        scenario = expand_clips(load_scenario(self.scenario), self.folder)
        worn = select_stations(scenario, self.stations)
        return replace(scenario, stations={name: scenario.stations[name] for name in worn}, worn=())

    @property
    def poses(self) -> tuple[CalibrationPose, ...]:
        return POSES if self.kind == "poses" else POSES[:1]

    @property
    def mounts(self) -> tuple[Mount, ...]:
        """Nominal mounts of the stations."""
        return self.resolved_scenario.nominal_mounts

    @cached_property
    def body(self) -> Body:
        """The performer's body for `tpose`, the standard body for `poses`."""
        if self.kind == "poses":
            return build_body()
        if self.skeleton is not None:
            return build_body(self.skeleton)
        return prepare_playback(self.scenario, clip=self.clip, folder=self.folder).body

    @cached_property
    def pose_qpos(self) -> list[Floats]:
        """Configurations (55,) of the poses on that body."""
        return [pose_configuration(pose, self.body.skeleton) for pose in self.poses]

    @cached_property
    def source(self) -> MotionSource:
        """The scenario's motion source."""
        return open_scenario_motion(self.resolved_scenario.motion, self.folder, self.resolved_scenario.seed)

    @cached_property
    def space(self) -> SkeletonPrior:
        """Prior on bone lengths, from the people of the scenario's motion source."""
        source = self.source
        people = source.other_skeletons(without=source.subject(ClipPart.parse(self.clip).clip) if self.clip else "")
        return fit_skeleton_prior(list(people.values()), source=f"{len(people)} people ({source.title})")

    def collect_poses(
        self,
        frames: Iterable[TrackerFrame],
        say: Notifier,
        displays: Sequence[PoseDisplay] = (),
    ) -> PoseCollector:
        """Guide the performer through the poses; UnusableHold when the stream ends before the last pose."""
        classifier = PoseClassifier(self.body, self.mounts, self.pose_qpos)
        collector = PoseCollector(self.stations, len(self.poses), classifier)
        preview = PerformerPreview(self.body, self.mounts, self.pose_qpos, classifier)
        PoseGuide(collector, self.poses, self.pose_qpos, displays, preview).run(frames, say)
        return collector

    def solve(self, held: Sequence[Sequence[TrackerFrame]], source: str) -> CalibrationOutcome:
        """Solve for the calibration; `source` describes where the frames come from. UnusableHold, BadInput."""
        if self.kind == "poses":
            eight = calibrate_poses(held, self.space, self.mounts)
            calibration, skeleton, (words, lines) = (
                eight.calibration,
                eight.skeleton,
                report_pose_calibration(eight),
            )
        else:
            tpose = calibrate_tpose(held[0], self.body, self.mounts)
            calibration, skeleton, (words, lines) = (
                tpose.calibration,
                self.body.skeleton,
                report_tpose_calibration(tpose),
            )
        made = {"made": datetime.now(UTC).isoformat(timespec="seconds"), "by": f"harness {VERSION}"}
        made |= {"source": source, "scenario": self.resolved_scenario.name}
        made |= {"others": self.space.source} if self.kind == "poses" else {}
        performer = self.source.performer(ClipPart.parse(self.clip).clip) if self.clip else ""
        return CalibrationOutcome(CalibrationFile(calibration, skeleton, {**made, **words}, performer), lines)
