"""The doctor's check that functions are compiled, on a broken installation too."""

from pathlib import Path

import pytest

from harness.core.cache_folder import cache_folder
from harness.testing import compilation_check
from harness.testing.compilation_check import check_compilation, describe_cache


@pytest.mark.long
def test_a_function_is_compiled_and_kept() -> None:
    assert check_compilation() == (True, "a small function was compiled, the next process loads it")


@pytest.mark.long
def test_a_process_that_cannot_compile_fails(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A lock that filelock refuses after a fork, as one that was made on import."""
    broken = "import filelock\n\ndef refuse(*given, **named):\n    raise RuntimeError('inherited across fork')\n\n"
    (tmp_path / "sitecustomize.py").write_text(broken + "filelock.FileLock.acquire = refuse\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    ok, seen = check_compilation()
    assert not ok
    assert seen == "a process that was started by fork cannot compile (exit code 1)"


def test_the_folder_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    cache_folder.cache_clear()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert describe_cache() == f"0.0 MB in {tmp_path / 'tracker-harness'}"
    monkeypatch.setattr(compilation_check, "cache_folder", lambda: None)
    assert describe_cache().startswith("nowhere: ")
    cache_folder.cache_clear()
