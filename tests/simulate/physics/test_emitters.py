"""Files of MCF lines: what is written is read again, and damaged files are refused with the line."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.core.package_data import data_folder
from harness.errors import BadFile
from harness.simulate.physics.emitters import MAX_MCF_BYTES, read_mcf
from harness.stream.polhemus.codec import Emitter
from tests.simulate.physics.rooms import write_mcf

LINE = b"31F      1   -0.9144   -0.6096    0.0000   0.00   0.00   1.00   5001\r\n"
OTHERS = [
    b"31F      2    0.9144   -0.6096    0.0000   0.00   0.00   1.00   5002\r\n",
    b"31F      3    0.9144    0.6096    0.0000   0.00   0.00   1.00   5003\r\n",
]


def write(folder: Path, *lines: bytes) -> Path:
    path = folder / "room.mcf"
    path.write_bytes(b"".join(lines))
    return path


coordinates = st.floats(-50.0, 50.0)
directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: float(np.linalg.norm(v)) > 0.1)


@settings(max_examples=100, deadline=None)
@given(places=st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=3, max_size=8), data=st.data())
def test_emitters_are_read_as_they_were_written(
    tmp_path_factory: pytest.TempPathFactory, places: list[tuple[float, float, float]], data: st.DataObject
) -> None:
    emitters = []
    for number, place in enumerate(places, start=1):
        vector = np.array(data.draw(directions))
        x, y, z = (vector / np.linalg.norm(vector)).tolist()
        apart = (place[0] + 101.0 * number, place[1], place[2])
        emitters.append(Emitter(number, apart, (x, y, z), 5000 + number))
    path = write_mcf(tmp_path_factory.mktemp("mcf"), emitters)
    found = read_mcf(path)
    assert [(e.number, e.identity) for e in found] == [(e.number, e.identity) for e in emitters]
    np.testing.assert_allclose([e.position_m for e in found], [e.position_m for e in emitters], atol=0.5001e-4)
    np.testing.assert_allclose([e.normal for e in found], [e.normal for e in emitters], atol=0.5001e-2)
    written = path.read_bytes()
    assert write_mcf(path.parent, found).read_bytes() == written


@pytest.mark.parametrize("end", [b"\n", b"\r", b"\r\n", b"\r\n\r\n", b" \r\n"])
def test_any_line_end_is_read(end: bytes, tmp_path: Path) -> None:
    lines = [line.rstrip() + end for line in (LINE, *OTHERS)]
    assert [emitter.number for emitter in read_mcf(write(tmp_path, *lines))] == [1, 2, 3]


@pytest.mark.parametrize(
    ("third", "said"),
    [
        (b"31F      3    0.9144    0.6096    0.0000   0.00   0.00   1.00\r\n", "the line '31F"),
        (b"31F      3    0.9144       nan    0.0000   0.00   0.00   1.00   5003\r\n", "the line '31F"),
        (b"31F     -3    0.9144    0.6096    0.0000   0.00   0.00   1.00   5003\r\n", "the line '31F"),
        (b"31F      3    0.9144    0.6096    0.0000   0.00   0.00   1.00   5003 7\r\n", "the line '31F"),
        (b"31P      3    0.9144    0.6096    0.0000   0.00   0.00   1.00   5003\r\n", "the line '31P"),
        (b"# emitters\r\n", "the line '# emitters'"),
        (b"\x00\xff\x8031F\r\n", "the line"),
        (b"31F" + 300 * b" " + b"3 0.9 0.6 0.0 0.0 0.0 1.0 5003\r\n", "the line '31F"),
        (b"31F" + 5000 * b"9" + b" 0.9 0.6 0.0 0.0 0.0 1.0 5003\r\n", "the line '31F"),
        (b"31F      3    0.9144    0.6096    0.0000   0.00   0.00   0.98   5003\r\n", "of length 0.980"),
        (b"31F      3    0.9144    0.6096    0.0000   0.00   0.00   0.00   5003\r\n", "of length 0.000"),
        (b"31F      3    0.9144   -0.6091    0.0000   0.00   0.00   1.00   5003\r\n", "at the place of emitter 2"),
        (b"31F      2    0.9144    0.6096    0.0000   0.00   0.00   1.00   5003\r\n", "a second emitter 2"),
        (b"31F      0    0.9144    0.6096    0.0000   0.00   0.00   1.00   5003\r\n", "emitter 0 with the identity"),
        (b"31F      3 2000.9144    0.6096    0.0000   0.00   0.00   1.00   5003\r\n", "coordinates up to 1000 m"),
    ],
)
def test_a_damaged_line_is_named(third: bytes, said: str, tmp_path: Path) -> None:
    with pytest.raises(BadFile) as caught:
        read_mcf(write(tmp_path, LINE, OTHERS[0], b"\r\n", third))
    assert caught.value.line == 4
    assert said in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


FOURTH = b"31F      4    0.0000    0.0000    0.0000   0.00   0.00   1.00   5004\r\n"
FOUR = [LINE, *OTHERS, FOURTH]


@pytest.mark.parametrize("lost", range(4))
def test_a_lost_line_is_noticed(tmp_path: Path, lost: int) -> None:
    """The first line says how many there are; without it the number of an emitter is missed, but for the last one."""
    rest = [line for place, line in enumerate(FOUR) if place != lost]
    with pytest.raises(BadFile, match="4 emitters announced and 3 listed"):
        read_mcf(write(tmp_path, b"# 4 emitters\r\n", *rest))
    if lost < 3:
        with pytest.raises(BadFile, match=f"no emitter {lost + 1}, though there are later ones"):
            read_mcf(write(tmp_path, *rest))
    assert len(read_mcf(write(tmp_path, b"# 3 emitters\n", *rest))) == 3  # a gap that is meant
    assert len(read_mcf(write(tmp_path, *FOUR))) == 4


def test_a_large_number_is_refused_at_once(tmp_path: Path) -> None:
    """Not one number after another up to it."""
    large = FOURTH.replace(b"    4 ", b" 999999999 ", 1)
    with pytest.raises(BadFile, match="no emitter 4, though there are later ones"):
        read_mcf(write(tmp_path, LINE, *OTHERS, large))


@pytest.mark.parametrize("head", [b"", b"# 4 emitters\r\n"])
def test_a_last_line_that_was_cut_is_noticed(tmp_path: Path, head: bytes) -> None:
    """Two digits of the identity are lost: the rest is still a line."""
    whole = head + b"".join(FOUR)
    with pytest.raises(BadFile, match="shorter than others and has no end"):
        read_mcf(write(tmp_path, whole[:-4]))
    assert read_mcf(write(tmp_path, whole[:-2]))[-1].identity == 5004  # the line end alone


@pytest.mark.parametrize(("name", "count"), [("cave", 9), ("hall", 36), ("real_cave", 18), ("real_walls", 18)])
def test_shipped_constellations_announce_their_number(name: str, count: int) -> None:
    path = data_folder("models") / "constellations" / f"{name}.mcf"
    first = path.read_bytes().split(b"\r\n")[0]
    assert first.startswith(b"# %d emitters" % count)
    assert (b" github.com/vrui-vr/vrui, etc/VRDevices.cfg" in first) == name.startswith("real")
    assert len(read_mcf(path)) == count


@pytest.mark.parametrize("lines", [[], [b"\r\n \r\n"], [LINE], [LINE, OTHERS[0]]])
def test_fewer_than_three_emitters_are_refused(lines: list[bytes], tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="3 or more"):
        read_mcf(write(tmp_path, *lines))


def test_many_emitters_and_large_files_are_refused(tmp_path: Path) -> None:
    many = [Emitter(n, (0.1 * n, 0.0, 0.0), (0.0, 0.0, 1.0), n).line() for n in range(1, 202)]
    assert len(read_mcf(write(tmp_path, *many[:200]))) == 200
    with pytest.raises(BadFile, match="more than 200 emitters") as caught:
        read_mcf(write(tmp_path, *many))
    assert caught.value.line == 201
    with pytest.raises(BadFile, match="bytes"):
        read_mcf(write(tmp_path, b"\n" * (MAX_MCF_BYTES + 1)))


@settings(max_examples=200, deadline=None)
@given(data=st.binary(max_size=300), place=st.integers(0, 210))
def test_damage_gives_emitters_or_one_error(data: bytes, place: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    whole = LINE + b"".join(OTHERS)
    path = write(tmp_path_factory.mktemp("mcf"), whole[:place] + data + whole[place + len(data) :])
    try:
        found = read_mcf(path)
    except BadFile as error:
        said = str(error)
    else:
        assert len(found) >= 3
        return
    assert said.startswith(str(path))
    assert len(said.splitlines()) == 1
