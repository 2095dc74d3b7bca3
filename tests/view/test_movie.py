"""Movies of a viewed clip: length, panes, colours, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from harness.errors import BadInput, MissingExtra, SystemFault, UnknownName
from harness.report.kit import start_renderer
from harness.view import movie
from harness.view.movie import MoviePart, check_movie, write_movie
from harness.view.page import ViewedMotion


@pytest.mark.parametrize(
    ("part", "error", "said"),
    [
        (MoviePart(("pca",)), UnknownName, "no method called 'pca'.* Known: map, ik, far"),
        (MoviePart(("ik",) * 4), BadInput, "4 methods in a movie. Name at most 3."),
        (MoviePart((), 3.0, 4.0), BadInput, "from 3 to 4 s has no frames. The clip lasts from 0.01 to 1.98 s."),
        (MoviePart((), 1.5, 1.4), BadInput, "from 1.5 to 1.4 s has no frames"),
    ],
)
def test_parts_that_cannot_be_drawn_are_refused(
    part: MoviePart, error: type[Exception], said: str, motion: ViewedMotion, tmp_path: Path
) -> None:
    with pytest.raises(error, match=said):
        write_movie(motion.skeleton, motion.clip(0), part, tmp_path / "a.mp4")
    assert not list(tmp_path.iterdir())


def test_too_long_a_movie_is_refused(motion: ViewedMotion, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(movie, "_MOST_FRAMES", 20)
    with pytest.raises(BadInput, match=r"A movie of 50 frames\. Choose a part of at most 1 s."):
        write_movie(motion.skeleton, motion.clip(0), MoviePart(), tmp_path / "a.mp4")


def test_other_suffixes_and_missing_packages_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(BadInput, match=r"Its end must be \.mp4 or \.gif"):
        check_movie(Path("a.avi"))
    monkeypatch.setattr(movie, "find_spec", lambda name: None if name == "imageio_ffmpeg" else object())
    check_movie(Path("a.GIF"))
    with pytest.raises(MissingExtra, match="needs imageio_ffmpeg"):
        check_movie(Path("a.mp4"))
    monkeypatch.setattr(movie, "find_spec", lambda name: None)
    with pytest.raises(MissingExtra, match="needs pyvista"):
        check_movie(Path("a.gif"))


def test_a_renderer_that_fails_leaves_no_file(
    motion: ViewedMotion, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    none = [str(tmp_path / "none.npz")]
    monkeypatch.setattr(movie, "start_renderer", lambda module, _: start_renderer(module, none))
    with pytest.raises(SystemFault, match="The movie was not made: the renderer failed"):
        write_movie(motion.skeleton, motion.clip(0), MoviePart(), tmp_path / "a.gif")
    assert not (tmp_path / "a.gif").exists()


def reddish(picture: Any) -> int:
    red, green, blue = np.moveaxis(np.asarray(picture, dtype=int), -1, 0)
    return int(np.sum((red - blue > 90) & (red - green > 60)))


@pytest.mark.long
def test_two_methods_stand_side_by_side_in_real_time(motion: ViewedMotion, tmp_path: Path, renders: None) -> None:
    """The second method errs by 300 mm and is red, but for the frames without an estimate."""
    told: list[tuple[int, int]] = []
    part = MoviePart(("map", "far"), 1.0, 1.5, True)
    frames = write_movie(
        motion.skeleton, motion.clip(0), part, tmp_path / "a.gif", lambda _, done, planned: told.append((done, planned))
    )
    assert told[0] == (0, 7)
    assert told == sorted(told)
    with Image.open(tmp_path / "a.gif") as picture:
        assert frames == getattr(picture, "n_frames") == 7  # noqa: B009
        assert picture.size == (960, 560)
        assert picture.info["duration"] == 80
        still = np.asarray(picture.convert("RGB"))[80:]  # below the captions
    assert reddish(still[:, 480:]) > 3000
    assert reddish(still[:, :480]) < 500


@pytest.mark.long
def test_a_motion_alone_fills_the_picture(motion: ViewedMotion, tmp_path: Path, renders: None) -> None:
    import imageio_ffmpeg

    assert write_movie(motion.skeleton, motion.clip(0), MoviePart((), 0.0, 1.0), tmp_path / "a.mp4") == 25
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "a.mp4"))
    facts = next(reader)
    assert (facts["size"], facts["fps"]) == ((640, 640), 25.0)
    picture = np.frombuffer(next(reader), np.uint8).reshape(640, 640, 3).astype(int)
    reader.close()
    assert np.mean(picture[..., 2] - picture[..., 0] > 40) > 0.01, "no blue body"
