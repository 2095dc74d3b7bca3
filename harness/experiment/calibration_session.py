"""Somebody stands model for a calibration: what they are to hold, whether they do, and what is kept of it."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Literal

from harness.body.humanoid import Body, build_body
from harness.body.mounts import Mount
from harness.calibrate import calibration_report
from harness.calibrate.calibration_file import CalibrationFile
from harness.calibrate.guided_calibration import Notifier, PoseDisplay, PoseGuide
from harness.calibrate.pose_calibration import calibrate_poses
from harness.calibrate.pose_classifier import PoseClassifier
from harness.calibrate.pose_collector import PoseCollector
from harness.calibrate.poses import POSES, CalibrationPose, configuration
from harness.calibrate.skeleton_prior import SkeletonPrior, fit_skeleton_prior
from harness.calibrate.tpose_calibration import calibrate_tpose
from harness.core.arrays import Floats
from harness.core.package_data import VERSION
from harness.core.split import ClipPart
from harness.experiment.cells import open_scenario_motion
from harness.experiment.clip_evaluation import mounts_of
from harness.experiment.playback import prepare_playback, select_stations
from harness.experiment.scenario import Scenario, expand_clips, load_scenario
from harness.stream.frame import TrackerFrame

CalibrationKind = Literal["poses", "tpose"]


@dataclass(frozen=True, eq=False)
class CalibrationOutcome:
    """A calibration, and what there is to say of it."""

    file: CalibrationFile
    lines: list[str]


@dataclass(frozen=True, eq=False)
class CalibrationSession:
    """A performer with these stations of a scenario on; UnknownName and BadFile as for a run of it."""

    scenario: Path | str
    stations: tuple[str, ...]
    """In the order of the stream's rows."""
    kind: CalibrationKind = "poses"
    """Bones, mounts and room of eight poses; or mounts and room of the first alone, on a body that is known."""
    clip: str | None = None
    """Whose body that is, and of whose bones nothing may be known beforehand; None: the scenario's first, nobody."""
    folder: Path | None = None
    """Library of real motion, where the scenario needs one."""

    @cached_property
    def resolved_scenario(self) -> Scenario:
        """With no other stations, in this order."""
        scenario = expand_clips(load_scenario(self.scenario), self.folder)
        worn = select_stations(scenario, self.stations)
        return replace(scenario, stations={name: scenario.stations[name] for name in worn}, worn=())

    @property
    def poses(self) -> tuple[CalibrationPose, ...]:
        return POSES if self.kind == "poses" else POSES[:1]

    @property
    def mounts(self) -> tuple[Mount, ...]:
        """Where the stations are said to be worn."""
        return mounts_of(self.resolved_scenario)

    @cached_property
    def body(self) -> Body:
        """The performer's where it is known, otherwise the standard one."""
        if self.kind == "poses":
            return build_body()
        return prepare_playback(self.scenario, clip=self.clip, folder=self.folder).body

    @cached_property
    def pose_qpos(self) -> list[Floats]:
        """The poses (55,) of that body."""
        return [configuration(pose, self.body.skeleton) for pose in self.poses]

    @cached_property
    def space(self) -> SkeletonPrior:
        """What people's bones are like: the scenario's source knows some."""
        motion = self.resolved_scenario.motion
        source = open_scenario_motion(motion, self.folder, self.resolved_scenario.seed)
        people = source.other_skeletons(without=source.subject(ClipPart.parse(self.clip).clip) if self.clip else "")
        return fit_skeleton_prior(list(people.values()), source=f"{len(people)} people ({source.title})")

    def collect_poses(
        self,
        frames: Iterable[TrackerFrame],
        say: Notifier,
        show: PoseDisplay | None = None,
        watch: Notifier = lambda text: None,
    ) -> PoseCollector:
        """Lead the performer through the poses; NotStanding when the stream ends before the last."""
        classifier = PoseClassifier(self.body, self.mounts, self.pose_qpos)
        collector = PoseCollector(self.stations, len(self.poses), classifier)
        PoseGuide(collector, self.poses, self.pose_qpos, show).run(frames, say, watch)
        return collector

    def solve(self, held: Sequence[Sequence[TrackerFrame]], source: str) -> CalibrationOutcome:
        """Solve for what the poses tell; `source` is where the frames come from, in words. NotStanding, BadInput."""
        if self.kind == "poses":
            eight = calibrate_poses(held, self.space, self.mounts)
            calibration, skeleton, (words, lines) = (
                eight.calibration,
                eight.skeleton,
                calibration_report.report_pose_calibration(eight),
            )
        else:
            tpose = calibrate_tpose(held[0], self.body, self.mounts)
            calibration, skeleton, (words, lines) = (
                tpose.calibration,
                self.body.skeleton,
                calibration_report.report_tpose_calibration(tpose),
            )
        made = {"made": datetime.now(UTC).isoformat(timespec="seconds"), "by": f"harness {VERSION}"}
        made |= {"source": source, "scenario": self.resolved_scenario.name}
        made |= {"others": self.space.source} if self.kind == "poses" else {}
        return CalibrationOutcome(CalibrationFile(calibration, skeleton, {**made, **words}), lines)
