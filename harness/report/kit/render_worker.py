"""The rendering process: `python -m harness.report.kit.render_worker JOB.npz ...`, started by `render_process`.

Each job is a file of arrays (see `render_process.RenderJob`). A picture is written whole or not at all.
"""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.files import atomic_path
from harness.core.humanoid24 import standard_skeleton
from harness.report.kit.scene import Scene
from harness.score.pair import PoseSequence, compute_poses


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
    """Rendered frames, (height, width, 3) bytes each."""
    scene = Scene(truth.skeleton, estimate.skeleton, size, rotations.mean_heading_rad(truth.world_from_root))
    try:
        for frame in range(len(truth.root_m)):
            yield scene.picture(truth, estimate, frame)
    finally:
        scene.close()


if __name__ == "__main__":
    main(sys.argv[1:])
