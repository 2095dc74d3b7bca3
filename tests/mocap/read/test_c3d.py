"""C3D: markers are read in world axes, follow the bones of the same take, and damaged files are refused."""

import contextlib
from pathlib import Path

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.errors import BadFile
from harness.mocap.library import MotionLibrary
from harness.mocap.read.c3d import MarkerClip, measure_marker_spreads, read_c3d
from tests.mocap.c3d_bytes import DEC, INTEL, MIPS, c3d_bytes

ezc3d = pytest.importorskip("ezc3d", reason="its files are read for comparison: install the extra test")

LABELS = ["X:LFHD", "X:RFHD", "X:LTOE"]


def _write(file: Path, position_mm: Floats, *, unit: str = "mm", up: str = "+Z") -> bytes:
    """A file of three markers (T, 3, 3); the last one is missing in the first frame."""
    content = ezc3d.c3d()
    content["parameters"]["POINT"]["LABELS"]["value"] = LABELS
    content["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    content["parameters"]["POINT"]["RATE"]["value"] = [120.0]
    content.add_parameter("POINT", "X_SCREEN", ["+X"])
    content.add_parameter("POINT", "Y_SCREEN", [up])
    points = np.ones((4, 3, len(position_mm)))
    points[:3] = np.moveaxis(position_mm, -1, 0).swapaxes(1, 2)
    points[:, 2, 0] = np.nan
    content["data"]["points"] = points
    content.write(str(file))
    return file.read_bytes()


@pytest.fixture
def position_mm(rng: np.random.Generator) -> Floats:
    return rng.uniform(-900.0, 1800.0, size=(6, 3, 3))


def test_markers_come_back(tmp_path: Path, position_mm: Floats) -> None:
    _write(tmp_path / "91_01.c3d", position_mm)
    markers = read_c3d(tmp_path / "91_01.c3d")
    assert (markers.labels, markers.rate_hz, len(markers)) == (("LFHD", "RFHD", "LTOE"), 120.0, 6)
    assert (markers.unit_m, markers.unit_evidence) == (0.001, "mm, from POINT:UNITS")
    assert np.all(np.isnan(markers.position_m[0, 2]))
    seen = np.isfinite(markers.position_m)
    assert seen.sum() == 6 * 9 - 3
    np.testing.assert_allclose(markers.position_m[seen], position_mm[seen] * 0.001, atol=1e-6)


def test_y_up_is_turned_to_z_up(tmp_path: Path, position_mm: Floats) -> None:
    _write(tmp_path / "x.c3d", position_mm, unit="m", up="+Y")
    markers = read_c3d(tmp_path / "x.c3d")
    np.testing.assert_allclose(markers.position_m[1, 0], position_mm[1, 0][[2, 0, 1]], rtol=1e-6)


def test_an_unknown_unit_is_not_guessed_but_can_be_given(tmp_path: Path, position_mm: Floats) -> None:
    _write(tmp_path / "x.c3d", position_mm, unit="ell")
    with pytest.raises(BadFile, match=r"POINT:UNITS 'ell'.*--unit"):
        read_c3d(tmp_path / "x.c3d")
    assert read_c3d(tmp_path / "x.c3d", unit_m=0.5).unit_m == 0.5


def test_an_unknown_up_axis_is_not_guessed(tmp_path: Path, position_mm: Floats) -> None:
    _write(tmp_path / "x.c3d", position_mm, up="?")
    with pytest.raises(BadFile, match="which say where up is"):
        read_c3d(tmp_path / "x.c3d")


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (lambda b: b[:1000], "no C3D header"),
        (lambda b: b"\x00\x00" + b[2:], "no C3D header"),
        (lambda b: b"\xff" + b[1:], "parameters at block 255"),
        (lambda b: b[:2] + b"\x00\x00" + b[4:], "0 markers"),
        (lambda b: b[:-600], "is truncated"),
        (lambda b: b"", "an empty file"),
    ],
)
def test_damage_is_refused(tmp_path: Path, position_mm: Floats, change: object, found: str) -> None:
    assert callable(change)
    whole = _write(tmp_path / "x.c3d", np.tile(position_mm, (40, 1, 1)))
    (tmp_path / "x.c3d").write_bytes(change(whole))
    with pytest.raises(BadFile) as error:
        read_c3d(tmp_path / "x.c3d")
    assert found in str(error.value)


@pytest.mark.parametrize("seed", range(20))
def test_a_damaged_file_is_read_or_refused(tmp_path: Path, seed: int) -> None:
    """Bytes changed anywhere in header and parameters: the file is read or refused with BadFile."""
    content = bytearray(_write(tmp_path / "x.c3d", np.ones((3, 3, 3))))
    rng = np.random.default_rng(seed)
    for at in rng.integers(0, 1536, size=seed % 4 + 1):
        content[at] = rng.integers(256)
    (tmp_path / "x.c3d").write_bytes(bytes(content))
    with contextlib.suppress(BadFile):
        assert len(read_c3d(tmp_path / "x.c3d").labels) == 3


def read_bytes(folder: Path, content: bytes) -> MarkerClip:
    (folder / "x.c3d").write_bytes(content)
    return read_c3d(folder / "x.c3d")


@pytest.mark.parametrize("processor", [INTEL, DEC, MIPS])
@pytest.mark.parametrize("scale", [-1.0, -0.1, 0.001])
@pytest.mark.parametrize("analog", [(0, 0), (3, 4)])
def test_all_forms_of_numbers_are_read(
    tmp_path: Path, position_mm: Floats, processor: int, scale: float, analog: tuple[int, int]
) -> None:
    position_m = position_mm / 1000.0
    found = read_bytes(tmp_path, c3d_bytes(position_m, processor=processor, scale=scale, analog=analog))
    np.testing.assert_allclose(found.position_m, position_m, atol=6e-4 if scale > 0.0 else 1e-6)
    assert (found.labels, found.rate_hz, found.notes) == (("bar_1", "bar_2", "bar_3"), 100.0, ())


def count_path(frames: int, markers: int = 2) -> Floats:
    """(T, M, 3) positions that tell their frame [m]."""
    path = np.ones((frames, markers, 3))
    path[:, :, 0] += np.arange(frames)[:, None]
    return path


@pytest.mark.long
@pytest.mark.parametrize(("frames", "markers"), [(65535, 2), (65536, 1), (70000, 33), (131072, 2)])
def test_a_long_file_of_ezc3d_is_read_to_its_last_frame(tmp_path: Path, frames: int, markers: int) -> None:
    content, points = ezc3d.c3d(), np.ones((4, markers, frames))
    point = content["parameters"]["POINT"]
    point["LABELS"]["value"], point["UNITS"]["value"] = [f"m{marker}" for marker in range(markers)], ["m"]
    point["RATE"]["value"] = [100.0]
    for axis, up in (("X_SCREEN", "+X"), ("Y_SCREEN", "+Z")):
        content.add_parameter("POINT", axis, [up])
    points[0] += np.arange(frames)
    content["data"]["points"] = points
    content.write(str(tmp_path / "x.c3d"))
    found = read_c3d(tmp_path / "x.c3d")
    assert len(found) == frames
    assert found.position_m[-1, 0, 0] == frames


@pytest.mark.parametrize(
    "counts",
    [
        {"last": 70000 % 65536, "frames": 70000 % 65536},
        {"last": 65535, "frames": 65535},
        {"last": 65535, "frames": 0},
        {"last": 65535, "frames": 65535, "long_frames": 70000.0},
        {"last": 65535, "frames": 65535, "trial": (1, 70000)},
        {"first": 60000, "last": 65535, "frames": 65535, "trial": (60000, 129999)},
        {"first": 10, "last": 70009 % 65536, "frames": 70000 % 65536, "long_frames": 70000.0, "trial": (10, 70009)},
    ],
)
@pytest.mark.parametrize("markers", [2, 17])
def test_the_size_proves_the_number_of_frames_of_a_long_file(
    tmp_path: Path, counts: dict[str, int], markers: int
) -> None:
    found = read_bytes(tmp_path, c3d_bytes(count_path(70000, markers), scale=-1.0, **counts))  # type: ignore[arg-type]  # keywords of several types
    assert len(found) == 70000
    assert found.position_m[-1, 0, 0] == 70000.0


def test_a_late_cut_of_a_long_take_is_read(tmp_path: Path) -> None:
    found = read_bytes(tmp_path, c3d_bytes(count_path(10001), first=60000, last=65535, trial=(60000, 70000)))
    assert len(found) == 10001


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"frames": 99}, "100 by the header, 99 by POINT:FRAMES"),
        ({"last": 99}, "99 by the header, 100 by POINT:FRAMES"),
        ({"last": 0}, "0 by the header"),
        ({"last": 101, "frames": 101, "rest": b""}, "truncated"),
        ({"last": 50, "frames": 50}, "50 by the header, 50 by POINT:FRAMES; 4"),
        ({"trial": (1, 99)}, "99 by TRIAL:ACTUAL_START_FIELD and ACTUAL_END_FIELD"),
        ({"trial": (2, 100 + 65536)}, "65635 by TRIAL"),
        ({"long_frames": 101.0}, "101 by POINT:LONG_FRAMES"),
        ({"rest": bytes(513)}, "one number of frames"),
        ({"rest": b"x" * 1024}, "one number of frames"),
        ({"numbers": {"USED": 1}}, "POINT:USED 1, but 2 in the header"),
        ({"numbers": {"RATE": 50.0}}, "POINT:RATE 50, but 100 in the header"),
        ({"numbers": {"SCALE": 0.1}}, "POINT:SCALE 0.1, but -1 in the header"),
        ({"numbers": {"DATA_START": 9.0}}, "POINT:DATA_START 9"),
    ],
)
def test_counts_that_disagree_and_bytes_left_over_are_refused(
    tmp_path: Path, change: dict[str, int], words: str
) -> None:
    with pytest.raises(BadFile) as error:
        read_bytes(tmp_path, c3d_bytes(count_path(100), **change))  # type: ignore[arg-type]  # keywords of several types
    assert words in str(error.value)


@pytest.mark.parametrize("rest", [b"", bytes(512), None])
def test_the_padding_of_the_last_block_is_no_frame(tmp_path: Path, rest: bytes | None) -> None:
    assert len(read_bytes(tmp_path, c3d_bytes(count_path(100), rest=rest))) == 100


@pytest.mark.parametrize("scale", [-1.0, 0.01])
def test_markers_at_the_origin_with_residual_zero_are_missing(tmp_path: Path, scale: float) -> None:
    points, residual = count_path(10), np.zeros((10, 2))
    points[3, 0], points[4, 1], points[5, 1] = 0.0, 0.0, 0.0
    residual[5, 1], residual[6, 0] = 2.0, -1.0
    found = read_bytes(tmp_path, c3d_bytes(points, scale=scale, residual=residual))
    missing = np.isnan(found.position_m[..., 0])
    assert [(int(t), int(m)) for t, m in np.argwhere(missing)] == [(3, 0), (4, 1), (6, 0)]
    assert found.notes == ("2 positions at exactly (0, 0, 0) count as markers that were not seen.",)


SPREAD_M = {"02_01": (0.012, 0.030), "02_05": (0.020, 0.045), "05_13": (0.040, 0.110)}
"""Median and largest spread of the 41 skin markers about their bones; the test prints them with -s."""


@pytest.mark.parametrize("name", sorted(SPREAD_M))
def test_markers_sit_on_the_bones_of_the_same_take(mocap: Path, name: str) -> None:
    markers = read_c3d(mocap / "c3d" / f"{name}.c3d")
    clip = MotionLibrary(mocap).load(name)
    assert (len(markers), markers.rate_hz, markers.unit_m) == (len(clip), clip.rate_hz, 0.001)
    spreads = measure_marker_spreads(markers, clip)[:41]
    for spread in spreads:
        print(f"{name} {spread.label:<5} {spread.bone:<10} {1000.0 * spread.spread_m:6.1f} mm")
    assert len(spreads) == 41
    sizes = [spread.spread_m for spread in spreads]
    assert np.median(sizes) < SPREAD_M[name][0]
    assert max(sizes) < SPREAD_M[name][1]
    bone = {spread.label: spread.bone for spread in spreads}
    assert bone["LANK"] in ("ltibia", "lfoot")
    assert bone["RANK"] in ("rtibia", "rfoot")


def test_the_joints_in_a_c3d_are_those_of_the_amc(mocap: Path) -> None:
    """05_13.c3d also holds joint centres that CMU's own program computed: they sit still in the AMC's bones.

    Those of the feet do not: there marker file and AMC of this take disagree by up to 0.1 m.
    """
    markers = read_c3d(mocap / "c3d" / "05_13.c3d")
    spread = {s.label: s.spread_m for s in measure_marker_spreads(markers, MotionLibrary(mocap).load("05_13"))}
    for label in ("LFE0", "RFE0", "LTI0", "RTI0", "LBK0", "TRX0", "HED0", "LHU0", "LHN0"):
        assert spread[label] < 0.001


def test_markers_of_two_subjects_with_one_label_keep_their_prefix(tmp_path: Path) -> None:
    file = tmp_path / "two.c3d"
    for labels, read in (
        (["Anna:h1", "Anna:h2"], ("h1", "h2")),
        (["Anna:h1", "Bert:h1"], ("Anna:h1", "Bert:h1")),
    ):
        file.write_bytes(c3d_bytes(np.ones((4, 2, 3)), labels=labels))
        assert read_c3d(file).labels == read
