"""The rendering process: `python -m harness.report.kit.render_worker JOB.npz ...`, started by `render_process`.

Each job is a file of arrays (see `render_process.RenderJob`). A picture is written whole or not at all. VTK may end the
process instead of raising if OpenGL does not work. The estimate is drawn slimmer than the truth, so it lies inside the
truth where it is right: the truth pale, the estimate orange.
"""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from harness.body import BodyMesh, RenderScene
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.files import atomic_path
from harness.core.humanoid24 import standard_skeleton
from harness.core.skeleton import Skeleton
from harness.score import PoseSequence, compute_poses

TRUTH, ESTIMATE = "#5b87ad", "#e8850c"
"""Colours that differ in lightness and in hue for every common kind of colour blindness."""


class Scene:
    """Renders pictures of a true and an estimated body."""

    def __init__(
        self, true_skeleton: Skeleton, estimated_skeleton: Skeleton, size: tuple[int, int], heading_rad: float
    ) -> None:
        """`size` is width and height [px]; `heading_rad` is where the body faces and places the camera."""
        self._stage = RenderScene(size, heading_rad, transparent=True)
        plotter = self._stage.plotter
        self._truth = BodyMesh(plotter, true_skeleton, TRUTH, girth=1.0, opacity=0.3, shadow=False)
        self._estimate = BodyMesh(plotter, estimated_skeleton, ESTIMATE, girth=0.5, opacity=1.0, shadow=False)

    def picture(self, truth: PoseSequence, estimate: PoseSequence, frame: int) -> np.ndarray:
        """Picture (height, width, 4) of one frame of both motions on transparent ground, 8 bit."""
        _move(self._truth, truth, frame)
        _move(self._estimate, estimate, frame)
        self._stage.follow(truth.root_m[frame])
        return self._stage.picture()

    def close(self) -> None:
        self._stage.close()


def _move(body: BodyMesh, motion: PoseSequence, frame: int) -> None:
    root = rotations.to_matrix(motion.world_from_root[frame])
    body.move(motion.root_m[frame], root, start_m(motion, frame), motion.world_from_bone[frame])


def start_m(motion: PoseSequence, frame: int) -> Floats:
    """(B, 3) joint that each bone rotates about, which is the far end of its parent [m]."""
    parents = np.array(motion.skeleton.parents)
    out: Floats = motion.joints_m[frame, parents + 1]
    return out


def main(jobs: Sequence[str]) -> None:
    for job in jobs:
        with np.load(job, allow_pickle=False) as content:
            true_skeleton, estimated_skeleton = (
                standard_skeleton().with_bones(content[name]) for name in ("bone_m", "estimate_bone_m")
            )
            truth, estimate = (
                compute_poses(true_skeleton, content["truth_qpos"]),
                compute_poses(estimated_skeleton, content["estimate_qpos"]),
            )
            width, height = (int(side) for side in content["size"])
            output = Path(str(content["output"]))
        with atomic_path(output) as temporary:
            write_strip(truth, estimate, (width, height), temporary)


def write_strip(truth: PoseSequence, estimate: PoseSequence, size: tuple[int, int], path: Path) -> None:
    """Write all frames side by side into one PNG, each of `size` [px]."""
    from matplotlib.image import imsave

    pictures = list(_pictures(truth, estimate, size))
    imsave(path, np.ascontiguousarray(np.hstack(pictures)), format="png")


def _pictures(truth: PoseSequence, estimate: PoseSequence, size: tuple[int, int]) -> Iterator[Floats]:
    """Rendered frames, (height, width, 4) bytes each."""
    scene = Scene(truth.skeleton, estimate.skeleton, size, rotations.mean_heading_rad(truth.world_from_root))
    try:
        for frame in range(len(truth.root_m)):
            yield scene.picture(truth, estimate, frame)
    finally:
        scene.close()


if __name__ == "__main__":
    main(sys.argv[1:])
