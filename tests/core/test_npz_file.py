"""Archives of arrays: plain values come back; objects, false headers and bombs are refused."""

import io
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from harness.core.npz_file import read_npz
from harness.errors import BadFile


def _read(path: Path, limit_bytes: int = 10_000) -> dict[str, np.ndarray]:
    return read_npz(path, "arrays", "Write them again.", limit_bytes=limit_bytes)


def _write(path: Path, **files: bytes) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(f"{name}.npy", data)


def _npy(header: str, data: bytes = b"") -> bytes:
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header) + 1) + header.encode() + b"\n" + data


def test_plain_arrays_come_back(tmp_path: Path) -> None:
    arrays = {
        "a": np.arange(6.0).reshape(2, 3),
        "f": np.asfortranarray(np.arange(6).reshape(2, 3)),
        "t": np.array(["x", "yz"]),
        "b": np.array([True, False]),
        "e": np.empty((0, 3)),
        "s": np.array(1.5),
    }
    np.savez_compressed(tmp_path / "x.npz", **arrays)  # type: ignore[arg-type]  # numpy's stub
    found = _read(tmp_path / "x.npz")
    assert found.keys() == arrays.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array)
        assert found[name].dtype == array.dtype
    chosen = read_npz(tmp_path / "x.npz", "arrays", "", limit_bytes=10_000, names=("a", "missing"))
    assert list(chosen) == ["a"]


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (_npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }"), "(1000000000000,) in "),
        (_npy("{'descr': '<f8', 'fortran_order': False, 'shape': (-1,), }", bytes(8)), "not plain values"),
        (_npy("{'descr': '|O', 'fortran_order': False, 'shape': (1,), }", bytes(8)), "not plain values"),
        (_npy("{'descr': '<f8', 'fortran_order': False, 'shape': " + "(" * 3000 + "}"), "a header that cannot be read"),
        (_npy("[" * 9000), "a header that cannot be read"),
        (b"", "a header that cannot be read"),
    ],
)
def test_a_false_header_is_refused(tmp_path: Path, data: bytes, reason: str) -> None:
    _write(tmp_path / "x.npz", a=data)
    with pytest.raises(BadFile) as refused:
        _read(tmp_path / "x.npz")
    assert reason in str(refused.value)


def test_a_pickle_is_never_run(tmp_path: Path) -> None:
    class Harmful:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return Path.touch, (str(tmp_path / "ran"),)

    out = io.BytesIO()
    np.save(out, np.array([Harmful()], dtype=object), allow_pickle=True)
    _write(tmp_path / "x.npz", a=out.getvalue())
    with pytest.raises(BadFile, match="not plain values"):
        _read(tmp_path / "x.npz")
    assert not (tmp_path / "ran").exists()


def test_an_archive_that_unpacks_to_more_than_the_limit_is_refused(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "x.npz", a=np.zeros(100_000))
    assert (tmp_path / "x.npz").stat().st_size < 10_000
    with pytest.raises(BadFile, match="unpacks to more"):
        _read(tmp_path / "x.npz")


def test_an_archive_of_very_many_files_is_refused(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "x.npz", "w") as archive:
        for number in range(30_000):
            archive.writestr(f"{number}", b"")
    with pytest.raises(BadFile, match="an archive of very many files"):
        _read(tmp_path / "x.npz", 100_000_000)


def test_an_array_that_stands_twice_in_an_archive_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "twice.npz"
    np.savez(path, allow_pickle=False, a=np.arange(3.0))
    with zipfile.ZipFile(path, "a") as archive, pytest.warns(UserWarning, match="Duplicate name"):
        archive.writestr("a.npy", archive.read("a.npy"))
    with pytest.raises(BadFile, match="an array twice"):
        _read(path)
