"""Archives of arrays (npz): read array by array as plain values, each of which has the size that its header says."""

import lzma
import math
import struct
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from harness.core.file_kind import wrong_file
from harness.core.input_file import MEGABYTE, check_input_file
from harness.errors import BadFile

_ARCHIVE_ERRORS = (
    *(zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error),
    *(OSError, EOFError, ValueError, OverflowError, NotImplementedError, RuntimeError, MemoryError),
)
"""Known exceptions of zipfile for damaged archives."""
_HEADER_ERRORS = (ValueError, TypeError, KeyError, SyntaxError, RecursionError, OverflowError, tokenize.TokenError)
"""Known exceptions of numpy for damaged headers."""
_HEADER_READERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
_KINDS = "biufU"
"""Kinds of arrays that are read: truth values, numbers and texts, never objects."""
_END, _END_BYTES, _LONGEST_COMMENT = b"PK\x05\x06", 22, 65_535
"""Mark and size of the record at the end of an archive, and the longest comment behind it."""
_LARGE_LOCATOR = b"PK\x06\x07"
"""Mark before that record in archives of more than 65,535 files or 4 GB."""
_MAX_LIST_BYTES = MEGABYTE
"""Longest list of the files in an archive [bytes]: `zipfile` builds an object for each of them."""


def read_npz(
    path: Path, expected: str, advice: str, *, limit_bytes: int, names: Sequence[str] | None = None
) -> dict[str, NDArray[Any]]:
    """The arrays of an archive by name, or those of `names` that it has.

    File and arrays together may each have `limit_bytes`. BadFile for another format, objects, headers that disagree
    with the size of their data, and damage.
    """
    check_input_file(path, expected, limit_bytes, advice)
    try:
        with open(path, "rb") as file:
            _check_list(path, file, expected, advice)
            with zipfile.ZipFile(file) as archive:
                wanted = [
                    info
                    for info in archive.infolist()
                    if info.filename.endswith(".npy") and (names is None or info.filename[:-4] in names)
                ]
                if len({info.filename for info in wanted}) < len(wanted):
                    raise BadFile(path, "an archive that has an array twice", expected, advice)
                if sum(info.file_size for info in wanted) > limit_bytes:
                    limit = f"{expected} of at most {limit_bytes // MEGABYTE} MB"
                    raise BadFile(path, "an archive that unpacks to more than that", limit, advice)
                return {info.filename[:-4]: _read_array(path, archive, info, expected, advice) for info in wanted}
    except _ARCHIVE_ERRORS as error:
        raise wrong_file(path, f"a broken archive ({error})", expected, advice) from error


def read_npy_header(file: BinaryIO) -> tuple[tuple[int, ...], bool, "np.dtype[Any]"]:
    """Shape, whether the first index runs fastest, and type of the array in an open npy file; ValueError."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy warns of headers of old Python versions, which it can read
            shape, fortran, dtype = _HEADER_READERS[np.lib.format.read_magic(file)](file)
    except (*_HEADER_ERRORS, MemoryError) as error:
        raise ValueError("a header that cannot be read") from error
    if dtype.kind not in _KINDS or dtype.shape or not all(type(n) is int and n >= 0 for n in shape):
        raise ValueError(f"{dtype!s:.40} {shape!s:.40}, not plain values")
    return shape, fortran, dtype


def _check_list(path: Path, file: BinaryIO, expected: str, advice: str) -> None:
    """BadFile for an archive whose list of files would take much memory."""
    file.seek(-min(file.seek(0, 2), _END_BYTES + _LONGEST_COMMENT), 2)
    tail = file.read()
    at = tail.rfind(_END)
    large = tail[max(at - 20, 0) : max(at - 16, 0)] == _LARGE_LOCATOR
    if at >= 0 and len(tail) >= at + _END_BYTES:
        large |= struct.unpack_from("<I", tail, at + 12)[0] > _MAX_LIST_BYTES
    if large:
        raise BadFile(path, "an archive of very many files", expected, advice)
    file.seek(0)


def _read_array(
    path: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo, expected: str, advice: str
) -> NDArray[Any]:
    with archive.open(info) as file:
        try:
            shape, fortran, dtype = read_npy_header(file)  # type: ignore[arg-type]  # numpy reads from any binary file
        except ValueError as error:
            raise BadFile(path, f"array {info.filename[:-4]:.40}: {error}", expected, advice) from error
        size = math.prod(shape) * dtype.itemsize
        if size != info.file_size - file.tell():
            found = f"array {info.filename[:-4]:.40} of {dtype} {shape!s:.60} in {info.file_size} bytes"
            raise BadFile(path, found, expected, advice)
        data = file.read()
    values = np.frombuffer(data, dtype) if size else np.empty(0, dtype)
    return values.reshape(shape, order="F" if fortran else "C").copy()
