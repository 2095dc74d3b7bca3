"""Truth and estimate as bodies in one picture, off-screen: a pale true body, an orange estimated one.

VTK without a working OpenGL may end the process instead of raising, so nothing but `harness.report.kit.render_worker` imports
this file, in a process of its own. The estimate is drawn slimmer than the truth: where it is right it lies inside.
"""

import numpy as np

from harness.body.rendering import BodyMesh, RenderScene
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.score.pair import PoseSequence

TRUTH, ESTIMATE = "#5b87ad", "#e8850c"
"""Apart in lightness and in hue for every common kind of colour blindness."""


class Scene:
    """One stage for many pictures of two bodies."""

    def __init__(self, true: Skeleton, estimated: Skeleton, size: tuple[int, int], heading_rad: float) -> None:
        """`size` in pixels; `heading_rad` is where the body faces, to see it from ahead and from the side."""
        self._stage = RenderScene(size, heading_rad)
        self._truth = BodyMesh(self._stage.plotter, true, TRUTH, girth=1.0, opacity=0.3)
        self._estimate = BodyMesh(self._stage.plotter, estimated, ESTIMATE, girth=0.5, opacity=1.0)

    def picture(self, truth: PoseSequence, estimate: PoseSequence, frame: int) -> np.ndarray:
        """(height, width, 3) bytes of one frame of both motions."""
        _move(self._truth, truth, frame)
        _move(self._estimate, estimate, frame)
        self._stage.follow(truth.root_m[frame])
        return self._stage.picture()

    def close(self) -> None:
        self._stage.close()


def _move(figure: BodyMesh, motion: PoseSequence, frame: int) -> None:
    root = rotations.to_matrix(motion.world_from_root[frame])
    figure.move(motion.root_m[frame], root, start_m(motion, frame), motion.world_from_bone[frame])


def start_m(motion: PoseSequence, frame: int) -> Floats:
    """(B, 3) joint that each bone turns about: the far end of its parent [m]."""
    parents = np.array(motion.skeleton.parents)
    out: Floats = motion.joints_m[frame, parents + 1]
    return out
