"""The packed data of the 3-D player: what comes back is what was put in, within a millimetre."""

import base64
import gzip

import numpy as np
import pytest

from harness.core.arrays import Floats, Ints
from harness.core.humanoid24 import standard_skeleton
from harness.report.kit.motion_player import (
    PlayerClip,
    PlayerMoment,
    PlayerMotion,
    PlayerStations,
    PlayerTrack,
    encode,
    pack_motion,
    player_card,
)

FRAMES, JOINTS = 50, 25
REGION_DEG = np.linspace(5.0, 20.0, FRAMES)


def decode(data: bytes) -> Ints:
    """The integers of a chunk, as `motion_data.js` reads them."""
    frames, columns = np.frombuffer(data, "<u4", 2).astype(int)
    codes = np.frombuffer(data, np.uint8, frames * columns, 8).astype(np.int64)
    codes[codes == 255] = np.frombuffer(data, "<u4", offset=8 + frames * columns)
    changes = np.where(codes % 2, -(codes + 1) // 2, codes // 2)
    out: Ints = np.cumsum(changes.reshape(columns, frames), axis=1).T
    return out


def motion(rng: np.random.Generator) -> PlayerMotion:
    """A clip of a truth and two estimates that walk randomly, with two stations."""
    joints_m = rng.normal(size=(1, JOINTS, 3)) + np.cumsum(0.01 * rng.normal(size=(FRAMES, JOINTS, 3)), axis=0)
    solved = np.zeros(FRAMES, dtype=np.int64)
    estimates = [PlayerTrack("ik", joints_m + 0.05, solved), PlayerTrack("<b>", joints_m + 0.1, solved, REGION_DEG)]
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (FRAMES, 2, 1))
    states, quality = np.zeros((FRAMES, 2), dtype=np.int64), np.ones((FRAMES, 2))
    stations = PlayerStations(("head", "torso"), joints_m[:, :2], turn, states, quality)
    truth = PlayerTrack("truth", joints_m, solved)
    clip = PlayerClip("walk", "a walk", np.arange(FRAMES) / 40, 0.5, truth, estimates, stations)
    return PlayerMotion(standard_skeleton(), [clip], [PlayerMoment("worst", 0, "ik", 0.2, 0.5)])


@pytest.mark.parametrize("largest", [1, 126, 127, 128, 129, 100_000])
def test_integers_survive_the_packing(largest: int, rng: np.random.Generator) -> None:
    rows = rng.integers(-largest, largest + 1, size=(40, 7))
    np.testing.assert_array_equal(decode(encode(rows)), rows)


def test_small_changes_take_one_byte() -> None:
    rows = np.cumsum(np.full((100, 3), -127), axis=0)
    assert len(encode(rows)) == 8 + rows.size
    assert len(encode(np.cumsum(np.full((100, 3), 128), axis=0))) == 8 + 5 * rows.size


def unpack(chunks: list[str], store: list[bytes]) -> Floats:
    return np.concatenate([decode(gzip.decompress(store[int(chunk)])) for chunk in chunks]).astype(float)


@pytest.mark.parametrize("chunk_frames", [1, 7, FRAMES, 1000])
def test_joints_come_back_within_half_a_millimetre(chunk_frames: int, rng: np.random.Generator) -> None:
    made, store = motion(rng), list[bytes]()

    def write(data: bytes) -> str:
        store.append(data)
        return str(len(store) - 1)

    packed = pack_motion(made, write, chunk_frames)
    (clip,) = packed["clips"]
    assert len(clip["time"]) == -(-FRAMES // chunk_frames)
    np.testing.assert_allclose(unpack(clip["time"], store)[:, 0] / 1e4, made.clips[0].time_s, atol=5e-5)
    assert [track["role"] for track in clip["tracks"]] == ["truth", "estimate", "estimate"]
    for track, source in zip(clip["tracks"], (made.clips[0].truth, *made.clips[0].estimates), strict=True):
        assert source is not None
        joints_mm = unpack(track["joints"], store).reshape(FRAMES, JOINTS, 3)
        for start, end in packed["bones"]:
            joints_mm[:, end] += joints_mm[:, start]
        np.testing.assert_allclose(joints_mm, 1e3 * source.joints_m, atol=0.5 + 1e-9)
    assert [track["region"] is None for track in clip["tracks"]] == [True, True, False]
    np.testing.assert_allclose(unpack(clip["tracks"][2]["region"], store)[:, 0], REGION_DEG * 10.0, atol=0.5 + 1e-9)
    poses = unpack(clip["stations"]["poses"], store).reshape(FRAMES, 2, 7)
    assert made.clips[0].stations is not None
    np.testing.assert_allclose(poses[..., :3], 1e3 * made.clips[0].stations.position_m, atol=0.5 + 1e-9)
    np.testing.assert_allclose(poses[..., 3:], [[[1000, 0, 0, 0]] * 2] * FRAMES)
    assert packed["moments"] == [{"title": "worst", "clip": 0, "method": "ik", "time_s": 0.2, "end_s": 0.5}]


def test_bones_have_the_girth_of_their_side_less_name(rng: np.random.Generator) -> None:
    packed = pack_motion(motion(rng), lambda data: base64.b64encode(data).decode())
    radii = dict(zip(standard_skeleton().names, packed["radii_mm"], strict=True))
    assert radii["lfemur"] == radii["rfemur"] == [84, 54]
    assert radii["lowerback"] == [105, 110]


def test_names_cannot_end_the_data(rng: np.random.Generator) -> None:
    assert "<b>" not in player_card(motion(rng), "bodies")
