"""The cache folder belongs to its user alone, and there is always one or a plain None."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from harness.core import cache_folder as module
from harness.core.cache_folder import cache_folder, folder_bytes, keep_newest, remove_cache
from harness.reconstruct import source_files

needs_owners = pytest.mark.skipif(not hasattr(os, "getuid"), reason="this system has no owners and modes of folders")


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A user whose folders for caches and for temporary files lie in the returned folder."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(module, "user_cache_path", lambda name, appauthor: tmp_path / ".cache" / name)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    (tmp_path / "tmp").mkdir()
    cache_folder.cache_clear()
    yield tmp_path
    cache_folder.cache_clear()


def test_it_is_made_for_the_user_alone(home: Path) -> None:
    assert cache_folder() == home / ".cache" / "tracker-harness"
    assert cache_folder() is cache_folder()
    if os.name == "posix":
        assert (home / ".cache" / "tracker-harness").stat().st_mode & 0o777 == 0o700


def test_the_variable_of_numba_comes_first(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(home / "chosen"))
    assert cache_folder() == home / "chosen" / "tracker-harness"


@needs_owners
def test_where_others_may_write_it_is_not_used(home: Path) -> None:
    folder = home / ".cache" / "tracker-harness"
    folder.mkdir(parents=True)
    folder.chmod(0o770)
    assert cache_folder() == home / "tmp" / f"tracker-harness-{os.getuid()}"


@needs_owners
def test_the_folder_of_another_user_is_not_used(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (home / ".cache" / "tracker-harness").mkdir(parents=True)
    (home / "tmp" / f"tracker-harness-{os.getuid() + 1}").mkdir()
    own = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: own + 1)
    assert cache_folder() is None


def test_a_link_is_not_followed(home: Path) -> None:
    (home / "elsewhere").mkdir()
    (home / ".cache").mkdir()
    (home / ".cache" / "tracker-harness").symlink_to(home / "elsewhere")
    found = cache_folder()
    assert found is not None
    assert found.parent == home / "tmp"


def test_a_file_in_its_place_and_nowhere_to_write(home: Path) -> None:
    (home / ".cache").write_text("no folder")
    found = cache_folder()
    assert found is not None
    assert found.parent == home / "tmp"
    found.rmdir()
    (home / "tmp").rmdir()
    (home / "tmp").write_text("no folder")
    cache_folder.cache_clear()
    assert cache_folder() is None


def test_relative_folders_of_the_user_are_ignored(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "user_cache_path", lambda name, appauthor: Path("relative") / name)
    found = cache_folder()
    assert found is not None
    assert found.parent == home / "tmp"


def test_removal_says_how_much(home: Path) -> None:
    assert remove_cache() == 0
    for folder in (cache_folder(), home / "tmp" / "tracker-harness-elsewhere"):
        assert folder is not None
        (folder / "machine-code").mkdir(parents=True)
        (folder / "machine-code" / "a.nbc").write_bytes(b"x" * 1000)
    assert folder_bytes(home / ".cache") == 1000
    assert remove_cache() == 1000
    assert not (home / ".cache" / "tracker-harness").exists()
    assert (home / "tmp" / "tracker-harness-elsewhere").exists()


def test_it_is_no_folder_of_a_method(home: Path) -> None:
    """A method in the home folder reads machine code below its own folder."""
    source_files._foreign_folders.cache_clear()
    try:
        assert cache_folder() in source_files.foreign_folders()
    finally:
        source_files._foreign_folders.cache_clear()


def test_only_the_newest_are_kept(tmp_path: Path) -> None:
    for age, name in enumerate("dacb"):
        (tmp_path / name).mkdir()
        os.utime(tmp_path / name, (1e9 - age, 1e9 - age))
    keep_newest(tmp_path, 2)
    assert sorted(place.name for place in tmp_path.iterdir()) == ["a", "d"]
