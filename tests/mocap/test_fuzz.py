"""Damaged files: the parsers read them or refuse them with BadFile, and do nothing else."""

import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from harness.core.humanoid24 import standard_skeleton
from harness.errors import BadFile
from harness.mocap.read import amass, bvh, mvnx
from harness.mocap.read.amc import read_amc
from harness.mocap.read.asf import read_asf
from harness.mocap.read.c3d import read_c3d
from harness.mocap.read.joint_clip import JointClip
from tests.mocap.c3d_bytes import c3d_bytes
from tests.mocap.sample_files import amass_arrays, amc_text, asf_text, bvh_text, clip, mvnx_text

SKELETON = standard_skeleton()
QUICK = settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)


def _npz() -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, allow_pickle=False, **amass_arrays(clip(2)))
    return file.getvalue()


def _c3d() -> bytes:
    """Three frames of two markers, with an analog channel."""
    return c3d_bytes(np.ones((3, 2, 3)), analog=(1, 2), trial=(1, 3))


SOUND: dict[str, tuple[bytes, Callable[[Path], object]]] = {
    "asf": (asf_text(SKELETON).encode(), read_asf),
    "amc": (amc_text(clip(3)).encode(), lambda path: read_amc(path, SKELETON, rate_hz=120.0)),
    "bvh": (bvh_text(clip(2)).encode(), bvh.read_bvh),
    "mvnx": (mvnx_text(clip(2)).encode(), mvnx.read_mvnx),
    "npz": (_npz(), amass.read_amass),
    "c3d": (_c3d(), read_c3d),
}
PLACE = st.floats(0.0, 1.0, exclude_max=True)
CHANGE = st.one_of(
    st.tuples(st.just("byte"), PLACE, st.integers(0, 255)),
    st.tuples(
        st.just("word"), PLACE, st.sampled_from(["nan", "-inf", "1e308", "0", "1_0", "-", "{", "}", "root", "é"])
    ),
    st.tuples(st.just("drop line"), PLACE, st.none()),
    st.tuples(st.just("double line"), PLACE, st.none()),
    st.tuples(st.just("swap lines"), PLACE, PLACE),
    st.tuples(st.just("cut"), PLACE, st.none()),
    st.tuples(st.just("insert"), PLACE, st.binary(max_size=12)),
)


def _changed(content: bytes, how: str, where: float, what: object) -> bytes:
    at = int(where * len(content))
    if how == "byte" and isinstance(what, int) and content:
        return content[:at] + bytes([what]) + content[at + 1 :]
    if how == "cut":
        return content[:at]
    if how == "insert" and isinstance(what, bytes):
        return content[:at] + what + content[at:]
    if how == "word" and isinstance(what, str):
        words = content.split(b" ")
        words[int(where * len(words))] = what.encode()
        return b" ".join(words)
    lines = content.split(b"\n")
    line = int(where * len(lines))
    if how == "drop line":
        del lines[line]
    elif how == "double line":
        lines.insert(line, lines[line])
    elif isinstance(what, float):
        other = int(what * len(lines))
        lines[line], lines[other] = lines[other], lines[line]
    return b"\n".join(lines)


@pytest.mark.parametrize("kind", sorted(SOUND))
@QUICK
@given(changes=st.lists(CHANGE, min_size=1, max_size=4))
@example(changes=[("cut", 0.0, None)])
@example(changes=[("double line", 0.5, None)])
def test_a_changed_file_is_read_or_refused(tmp_path: Path, kind: str, changes: list[tuple[str, float, object]]) -> None:
    content, read = SOUND[kind]
    for change in changes:
        content = _changed(content, *change)
    file = tmp_path / f"x.{kind}"
    file.write_bytes(content)
    _read_or_refuse(file, read)


@pytest.mark.parametrize("kind", sorted(SOUND))
@QUICK
@given(content=st.binary(max_size=400))
def test_any_bytes_are_read_or_refused(tmp_path: Path, kind: str, content: bytes) -> None:
    file = tmp_path / f"x.{kind}"
    file.write_bytes(content)
    _read_or_refuse(file, SOUND[kind][1])


@pytest.mark.parametrize("kind", sorted(SOUND))
def test_the_files_to_be_damaged_are_sound(tmp_path: Path, kind: str) -> None:
    file = tmp_path / f"x.{kind}"
    file.write_bytes(SOUND[kind][0])
    SOUND[kind][1](file)


def _read_or_refuse(file: Path, read: Callable[[Path], object]) -> None:
    refused: BadFile | None = None
    try:
        found = read(file)
        assert not isinstance(found, JointClip) or np.all(np.isfinite(found.parent_from_joint))
    except BadFile as error:
        refused = error
    if refused is not None:
        assert refused.advice, str(refused)
        assert "\n" not in str(refused)
        assert len(str(refused)) < 2000
