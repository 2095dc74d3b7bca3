"""Draw the moving picture of README.md from a run: python docs/first_minute/render.py RUN

The clip must last eight seconds: set `longest_s = 8.0` in a copy of scenarios/demo.toml and run it with `--methods ik`.
Eight seconds of one clip: the stations alone, then the true body, then the estimate of a method, coloured by its error.
"""

import argparse
import os
from pathlib import Path

os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # before pyvista is imported: no screen needed

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from harness.body import RenderScene
from harness.commands.viewed_motion import open_motion
from harness.core.skeleton import Skeleton
from harness.report.kit import PlayerClip, bone_radii_mm
from harness.view.movie_worker import TRUTH, CapsuleMesh, error_colours, rgb, station_capsules

SIZE_PX = (480, 480)
FPS = 12.5
PHASES_S = (2.4, 4.8, 8.0)
"""Ends of the three phases."""
WORST_M = 0.05
"""Error that has the last colour."""
STATION_SIZE = 1.4
"""Stations are drawn larger than in the viewer, so that they can be seen in a small picture."""
INK, PAPER = "#23282f", "#f3f5f7"
CAPTIONS = (
    "1. Six trackers report where they are.",
    "2. The true body, known to the harness alone.",
    "3. A method's estimate, coloured by its error.",
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", help="folder of a run on the motion generator with clips of 8 s")
    parser.add_argument("--method", default="ik")
    parser.add_argument("--clip", default="boxing", help="first clip whose name begins so")
    parser.add_argument("--from", dest="start_s", type=float, default=0.0)
    args = parser.parse_args()
    motion = open_motion(args.run, methods=[args.method], mocap=None, rate_hz=None, playback={})
    number = next(n for n, name in enumerate(motion.names) if name.startswith(args.clip))
    pictures = draw(motion.skeleton, motion.clip(number), args.start_s)
    out = Path(__file__).parent / "six_stations.webp"
    durations = round(1000.0 / FPS)
    pictures[0].save(out, save_all=True, append_images=pictures[1:], duration=durations, loop=0, quality=60, method=6)
    print(f"{out}: {len(pictures)} frames, {out.stat().st_size / 1e3:.0f} kB")


def draw(skeleton: Skeleton, clip: PlayerClip, start_s: float) -> list[Image.Image]:
    """The frames, in real time from `start_s` on."""
    truth, estimate, stations = clip.truth, clip.estimates[0], clip.stations
    if truth is None or stations is None:
        raise SystemExit("The run has no truth or no stations: name a run of `harness run` or `harness demo`.")
    bones = np.array([[parent + 1, bone + 1] for bone, parent in enumerate(skeleton.parents)])
    radii_m = np.array(bone_radii_mm(skeleton)) / 1e3
    scene = RenderScene(SIZE_PX, clip.heading_rad)
    marks = CapsuleMesh(scene.plotter, 4 * len(stations.names), 1.0)
    inner = CapsuleMesh(scene.plotter, len(bones), 1.0)
    outer = CapsuleMesh(scene.plotter, len(bones), 0.3)
    pictures = []
    for shown_s in np.arange(round(PHASES_S[-1] * FPS)) / FPS:
        row = int(np.searchsorted(clip.time_s, start_s + shown_s + 1e-6, side="right")) - 1
        phase = int(np.searchsorted(PHASES_S, shown_s, side="right"))
        true_m, joints_m = truth.joints_m[row], estimate.joints_m[row]
        station = (stations.position_m[row], stations.world_from_station[row], stations.states[row])
        marks.move(*station_capsules(*station, STATION_SIZE))
        outer.move(true_m[bones], radii_m, np.broadcast_to(rgb(TRUTH), (len(bones), 2, 3)))
        outer.show(phase > 0)
        error_m = np.linalg.norm(joints_m - true_m, axis=1)
        inner.move(joints_m[bones], 0.6 * radii_m, error_colours(error_m, WORST_M)[bones])
        inner.show(phase > 1)
        scene.follow(true_m[0])
        pictures.append(add_caption(Image.fromarray(scene.picture()), phase, estimate.name, float(error_m.mean())))
    scene.close()
    return pictures


def add_caption(image: Image.Image, phase: int, method: str, mean_m: float) -> Image.Image:
    """The picture with the words of its phase, and in the last one the scale of the colours."""
    pen, (width, height) = ImageDraw.Draw(image), image.size
    pen.rectangle((0, 0, width, 44), fill=PAPER)
    pen.text((14, 11), CAPTIONS[phase], INK, ImageFont.load_default(20))
    if phase == 2:
        small = ImageFont.load_default(16)
        bar = np.rint(255.0 * error_colours(np.linspace(0.0, WORST_M, 160), WORST_M)).astype(np.uint8)
        image.paste(Image.fromarray(np.tile(bar[None], (14, 1, 1))), (14, height - 32))
        pen.text((182, height - 35), f"0 to {1e3 * WORST_M:.0f} mm", INK, small)
        pen.text((width - 14, height - 35), f"{method}: {1e3 * mean_m:.0f} mm", INK, small, anchor="ra")
    return image


if __name__ == "__main__":
    main()
