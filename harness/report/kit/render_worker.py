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
from harness.report.kit.scene import ESTIMATE, TRUTH, Scene
from harness.score.pair import PoseSequence, compute_poses

MOVIE_SIZE = (640, 640)
"""Width and height of a movie [px]; they must be even."""


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
            output, fps, title = Path(str(content["output"])), float(content["fps"]), str(content["title"])
        with atomic_path(output) as temporary:
            if fps:
                write_movie(truth, estimate, fps, title, temporary)
            else:
                write_strip(truth, estimate, (width, height), temporary)


def write_strip(truth: PoseSequence, estimate: PoseSequence, size: tuple[int, int], path: Path) -> None:
    """Write all frames side by side into one PNG, each of `size` [px]."""
    from matplotlib.image import imsave

    pictures = list(_pictures(truth, estimate, size))
    imsave(path, np.ascontiguousarray(np.hstack(pictures)), format="png")


def write_movie(truth: PoseSequence, estimate: PoseSequence, fps: float, title: str, path: Path) -> None:
    """Write all frames with a caption as an H.264 movie that browsers play."""
    import imageio_ffmpeg

    options = {"fps": fps, "codec": "libx264", "quality": None, "macro_block_size": 2, "pix_fmt_out": "yuv420p"}
    encoding = ["-crf", "22", "-preset", "veryfast", "-movflags", "+faststart", "-f", "mp4"]
    writer = imageio_ffmpeg.write_frames(str(path), MOVIE_SIZE, **options, output_params=encoding)
    writer.send(None)
    try:
        for frame, picture in enumerate(_pictures(truth, estimate, MOVIE_SIZE)):
            writer.send(_add_caption(picture, title, frame / fps))
    finally:
        writer.close()


def _add_caption(picture: Floats, title: str, time_s: float) -> bytes:
    """The bytes of the picture with the title, the time since the start and a key to the two bodies."""
    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(picture)
    pen, font = ImageDraw.Draw(image), ImageFont.load_default(17)
    pen.text((20, 16), title, "#23282f", font)
    pen.text((20, 40), f"{time_s:.2f} s", "#5d6773", font)
    for n, (name, colour) in enumerate((("truth", TRUTH), ("estimate", ESTIMATE))):
        pen.ellipse((20 + 90 * n, 606, 32 + 90 * n, 618), colour)
        pen.text((38 + 90 * n, 602), name, "#23282f", font)
    return image.tobytes()


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
