"""C3D: markers are read in world axes, follow the bones of the same take, and damaged files are refused."""

import contextlib
import sys
from pathlib import Path

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.errors import BadFile, MissingExtra
from harness.mocap.library import MotionLibrary
from harness.mocap.read import c3d, ezc3d_process
from harness.mocap.read.c3d import measure_marker_spreads, read_c3d

ezc3d = pytest.importorskip("ezc3d", reason="C3D files need the extra c3d")

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


def test_a_crash_of_ezc3d_is_an_error_like_any_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _write(tmp_path / "x.c3d", np.ones((3, 3, 3)))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(ezc3d_process, "__name__", "ends")  # the program that is started

    def read(end: str) -> None:
        (tmp_path / "ends.py").write_text(f"import os, sys\n{end}")
        read_c3d(tmp_path / "x.c3d")

    with pytest.raises(BadFile, match="it crashes"):
        read("os.abort()")
    with pytest.raises(BadFile, match="ValueError: no"):
        read(f"print('ValueError: no', file=sys.stderr)\nsys.exit({ezc3d_process.UNREADABLE})")
    with pytest.raises(MissingExtra, match=r"tracker-harness\[c3d\]"):
        read(f"sys.exit({ezc3d_process.NO_EZC3D})")


def test_a_file_that_keeps_ezc3d_busy_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _write(tmp_path / "x.c3d", np.ones((3, 3, 3)))
    monkeypatch.setattr(c3d, "TIMEOUT_S", 0.0)
    with pytest.raises(BadFile, match="keeps ezc3d busy"):
        read_c3d(tmp_path / "x.c3d")


def test_the_child_says_when_ezc3d_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ezc3d", None)
    assert ezc3d_process.main("any", "any") == ezc3d_process.NO_EZC3D


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
