"""The digest in the first line of TOML files."""

from hashlib import sha256
from pathlib import Path

import pytest

from harness.core.toml_file import insert_toml_digest, read_digested_toml
from harness.errors import BadFile
from tests.core.digested_toml import as_earlier_version, declare_edited

KIND = "a unit file"
TEXT = '# a comment\nschema = 2\nkind = "unit"\n\n[a]\nb = 1\n'


def write(folder: Path, text: str) -> Path:
    path = folder / "a.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = write(tmp_path, insert_toml_digest(TEXT))
    assert read_digested_toml(path, KIND, "") == ({"schema": 2, "kind": "unit", "a": {"b": 1}}, "")


def test_anyone_can_compute_the_digest(tmp_path: Path) -> None:
    path = write(tmp_path, insert_toml_digest(TEXT))
    first, rest = path.read_bytes().split(b"\n", 1)
    assert first.startswith(f'sha256 = "{sha256(rest).hexdigest()}" '.encode())


@pytest.mark.parametrize("lost", range(7))
def test_a_lost_line_is_noticed(tmp_path: Path, lost: int) -> None:
    lines = insert_toml_digest(TEXT).splitlines(keepends=True)
    assert len(lines) == 7
    with pytest.raises(BadFile):
        read_digested_toml(write(tmp_path, "".join(lines[:lost] + lines[lost + 1 :])), KIND, "")


def test_the_digest_stands_in_the_first_line_alone(tmp_path: Path) -> None:
    first, rest = insert_toml_digest(TEXT).split("\n", 1)
    with pytest.raises(BadFile, match="does not fit its digest"):
        read_digested_toml(write(tmp_path, rest.replace("schema", f"{first}\nschema", 1)), KIND, "")
    with pytest.raises(BadFile, match="no digest in its first line"):
        read_digested_toml(write(tmp_path, rest), KIND, "")


def test_what_cannot_be_verified_is_said(tmp_path: Path) -> None:
    whole = insert_toml_digest(TEXT)
    edited, caveat = read_digested_toml(write(tmp_path, declare_edited(whole).replace("b = 1", "b = 2")), KIND, "")
    assert (edited["a"], "edited by hand" in caveat) == ({"b": 2}, True)
    earlier, caveat = read_digested_toml(write(tmp_path, as_earlier_version(write(tmp_path, whole))), KIND, "")
    assert (earlier["schema"], "without a digest" in caveat) == (1, True)
    with pytest.raises(BadFile, match="schema 1; expected a unit file of schema 2"):
        read_digested_toml(write(tmp_path, whole.replace("schema = 2", "schema = 1")), KIND, "")
