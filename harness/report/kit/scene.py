"""Truth and estimate as two bodies in one picture, rendered off-screen: the truth pale, the estimate orange.

VTK may end the process instead of raising if OpenGL does not work. Therefore only
`harness.report.kit.render_worker` imports this module, in a separate process. The estimate is drawn slimmer than the
truth, so it lies inside the truth where it is right.
"""

import numpy as np

from harness.body.rendering import BodyMesh, RenderScene
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.score.pair import PoseSequence

TRUTH, ESTIMATE = "#5b87ad", "#e8850c"
"""Colours that differ in lightness and in hue for every common kind of colour blindness."""


class Scene:
    """Renders pictures of a true and an estimated body."""

    def __init__(
        self, true_skeleton: Skeleton, estimated_skeleton: Skeleton, size: tuple[int, int], heading_rad: float
    ) -> None:
        """`size` is width and height [px]; `heading_rad` is where the body faces and places the camera."""
        self._stage = RenderScene(size, heading_rad)
        self._truth = BodyMesh(self._stage.plotter, true_skeleton, TRUTH, girth=1.0, opacity=0.3)
        self._estimate = BodyMesh(self._stage.plotter, estimated_skeleton, ESTIMATE, girth=0.5, opacity=1.0)

    def picture(self, truth: PoseSequence, estimate: PoseSequence, frame: int) -> np.ndarray:
        """Picture (height, width, 3) of one frame of both motions, 8 bit."""
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
