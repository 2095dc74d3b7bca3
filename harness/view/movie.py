"""Movies and animated pictures of a viewed clip, drawn in a process of their own."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.files import write_npz
from harness.core.progress import ProgressCallback
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, MissingExtra, SystemFault, UnknownName
from harness.report.kit import PlayerClip, bone_radii_mm, finish_renderer, start_renderer

MOVIE_SUFFIXES = (".mp4", ".gif")
MOST_METHODS = 3
DRAWN_SUFFIX = ".drawn"
"""Ending of a file beside the job that has a byte for each frame that was drawn."""
_FPS = {".mp4": 25.0, ".gif": 12.5}
_MOST_FRAMES = 15_000
"""Longest movie: ten minutes of mp4."""
_STARTUP_TIMEOUT_S, _FRAME_TIMEOUT_S = 120.0, 2.0


@dataclass(frozen=True)
class MoviePart:
    """Which part of a clip a movie shows, and of which methods."""

    methods: Sequence[str] = ()
    """At most three, next to each other; none for the truth, or the motion, alone."""
    start_s: float = 0.0
    end_s: float = np.inf
    colour_by_error: bool = False


def check_movie(path: Path) -> None:
    """BadInput for a file name that is neither .mp4 nor .gif, MissingExtra without the packages that draw it."""
    suffix = path.suffix.lower()
    if suffix not in MOVIE_SUFFIXES:
        raise BadInput(f"{path.name} is no name of a movie.", f"Its end must be {' or '.join(MOVIE_SUFFIXES)}.")
    for package in ("pyvista", *(["imageio_ffmpeg"] if suffix == ".mp4" else [])):
        if find_spec(package) is None:
            raise MissingExtra("A movie", package, "viz")


def write_movie(
    skeleton: Skeleton,
    clip: PlayerClip,
    part: MoviePart,
    path: Path,
    progress: ProgressCallback = lambda name, done, planned: None,
) -> int:
    """Draw a part of a clip in real time into `path` (.mp4 at 25 frames per second, .gif at 12.5); returns the frames.

    `progress` is called while frames are drawn. Raises the errors of `check_movie`, UnknownName for a method that the
    clip lacks, BadInput for a part without frames or for more than three methods, and SystemFault when the pictures
    cannot be drawn.
    """
    check_movie(path)
    known = {track.name: track for track in clip.estimates}
    for name in part.methods:
        if name not in known:
            raise UnknownName("method", name, tuple(known))
    if len(part.methods) > MOST_METHODS:
        raise BadInput(f"{len(part.methods)} methods in a movie.", f"Name at most {MOST_METHODS}.")
    fps = _FPS[path.suffix.lower()]
    rows = _rows(clip.time_s, part, fps)
    arrays = {
        "output": np.array(str(path.resolve())),
        "fps": np.array(fps),
        "title": np.array(clip.title),
        "time_s": clip.time_s[rows],
        "heading_rad": np.array(clip.heading_rad),
        "bones": np.array([[parent + 1, bone + 1] for bone, parent in enumerate(skeleton.parents)]),
        "radii_m": np.array(bone_radii_mm(skeleton)) / 1e3,
        "methods": np.array([*part.methods], dtype=np.str_),
        "colour_by_error": np.array(part.colour_by_error),
    }
    if clip.truth:
        arrays |= {"truth_m": clip.truth.joints_m[rows], "truth_states": clip.truth.states[rows]}
    for n, name in enumerate(part.methods):
        arrays |= {f"joints_m_{n}": known[name].joints_m[rows], f"states_{n}": known[name].states[rows]}
    if clip.stations:
        arrays |= {
            "station_m": clip.stations.position_m[rows],
            "world_from_station": clip.stations.world_from_station[rows],
            "station_states": clip.stations.states[rows],
        }
    with TemporaryDirectory(prefix="harness-movie-") as folder:
        job = Path(folder) / "movie.npz"
        write_npz(job, **arrays)
        limit_s = _STARTUP_TIMEOUT_S + _FRAME_TIMEOUT_S * len(rows)
        with start_renderer("harness.view.movie_worker", [str(job)]) as renderer:
            reason = finish_renderer(renderer, limit_s, lambda: progress(path.name, _drawn_frames(job), len(rows)))
    if reason:
        raise SystemFault(f"The movie was not made: {reason}.", "Does this machine have OpenGL (EGL)?")
    return len(rows)


def _drawn_frames(job: Path) -> int:
    """Number of frames that the renderer of a job has drawn."""
    return sum(path.stat().st_size for path in job.parent.glob(f"{job.name}{DRAWN_SUFFIX}"))


def _rows(time_s: Floats, part: MoviePart, fps: float) -> Ints:
    """Rows of a clip that are shown at each time of the movie: the latest frame of that time. BadInput for none."""
    start_s, end_s = max(part.start_s, float(time_s[0])), min(part.end_s, float(time_s[-1]))
    if not start_s <= end_s:
        found = f"The part from {part.start_s:g} to {part.end_s:g} s has no frames."
        raise BadInput(found, f"The clip lasts from {time_s[0]:.2f} to {time_s[-1]:.2f} s.")
    count = int((end_s - start_s) * fps + 1e-6) + 1
    if count > _MOST_FRAMES:
        raise BadInput(f"A movie of {count:,} frames.", f"Choose a part of at most {_MOST_FRAMES / fps:.0f} s.")
    shown_s = start_s + np.arange(count) / fps
    out: Ints = np.searchsorted(time_s, shown_s + 1e-6, side="right") - 1
    return out
