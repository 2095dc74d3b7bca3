"""Machine code on disk is used again by the next process, and only as long as all that went into it is unchanged."""

import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module, invalidate_caches
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
import pytest
from numba.core import config, event
from numba.core.errors import TypingError

from harness.core import compiled as module
from harness.core.arrays import Floats
from harness.core.cache_folder import cache_folder
from harness.core.compiled import compiled, module_stamp, specialise

_config: Any = config  # numba has no types
_PACKAGE = {
    "__init__.py": "",
    "numbers_.py": "STEP = 1.0\n",
    "inner.py": "from harness.core.compiled import compiled\n"
    "from bench_package.numbers_ import STEP\n\n\n"
    "@compiled\ndef add(x: float) -> float:\n    return x + STEP\n",
    "middle.py": "from harness.core.compiled import compiled\n"
    "from bench_package.inner import add\n\n\n"
    "@compiled\ndef twice(x: float) -> float:\n    return 2.0 * add(x)\n",
    "outer.py": "from typing import NamedTuple\n"
    "from harness.core.compiled import compiled\n"
    "from bench_package import middle\n\n\n"
    "class Pair(NamedTuple):\n    first: float\n    second: float\n\n\n"
    "@compiled\ndef total(pair: Pair) -> float:\n    return middle.twice(pair.first) + pair.second\n",
}
_SCRIPT = """
from bench_package.outer import Pair, total
print(total(Pair(1.0, 10.0)), sum(total.stats.cache_hits.values()))
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    folder = tmp_path / "bench_package"
    folder.mkdir()
    for name, text in _PACKAGE.items():
        (folder / name).write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # the sources change within a second
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    cache_folder.cache_clear()
    yield folder
    _forget_package()
    cache_folder.cache_clear()


def _forget_package() -> None:
    for name in [name for name in sys.modules if name.startswith("bench_package")]:
        del sys.modules[name]
        module._source_hashes.pop(name, None)
    invalidate_caches()


def import_package(record: str = "Pair") -> tuple[float, int]:
    """The result of the outermost function, imported anew, and how often its machine code came from disk."""
    _forget_package()
    outer = import_module("bench_package.outer")
    return outer.total(getattr(outer, record)(1.0, 10.0)), sum(outer.total.stats.cache_hits.values())


def run_package(folder: Path, script: str = _SCRIPT, **environment: str) -> tuple[float, int]:
    """The same in a new process."""
    path = os.pathsep.join([str(folder.parent), *filter(None, sys.path)])
    result = subprocess.run(
        [sys.executable, "-c", script],
        env={
            **os.environ,
            "PYTHONPATH": path,
            "PYTHONDONTWRITEBYTECODE": "1",
            **environment,
        },
        capture_output=True,
        text=True,
        check=True,
    )
    value, hits = result.stdout.split()
    return float(value), int(hits)


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_a_change_of_an_imported_module_or_constant_compiles_its_callers_anew(package: Path) -> None:
    assert import_package() == (14.0, 0)
    edit(package / "inner.py", "x + STEP", "x - STEP")  # two imports away from the caller
    assert import_package() == (10.0, 0)
    edit(package / "numbers_.py", "1.0", "3.0")  # a module that has no compiled function
    assert import_package() == (6.0, 0)
    assert import_package() == (6.0, 1)


def test_a_renamed_record_does_not_break_the_load(package: Path) -> None:
    assert import_package() == (14.0, 0)
    edit(package / "outer.py", "Pair", "Couple")
    assert import_package("Couple") == (14.0, 0)
    assert import_package("Couple") == (14.0, 1)


def test_without_a_writable_folder_every_process_compiles(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", os.devnull + "/none")
    for _ in range(2):
        assert import_package() == (14.0, 0)
    assert not list(package.parent.rglob("*.nbi"))


def test_machine_code_lies_in_the_cache_folder_alone(package: Path) -> None:
    import_package()
    folders = {file.parent for file in package.parent.rglob("*.nb[ic]")}
    root = package.parent / "cache" / "tracker-harness" / "machine-code"
    assert {folder.parent for folder in folders} == {
        root / f"bench_package.{name}" for name in ("inner", "middle", "outer")
    }


def test_a_process_forked_after_the_import_compiles(package: Path) -> None:
    """The lock of a function belongs to the process that compiles: the server of methods forks after the import."""
    code = "import os\nfrom bench_package.outer import Pair, total\nchild = os.fork()\n"
    code += "if child == 0:\n    total(Pair(1.0, 10.0))\n    os._exit(0)\nprint(os.waitpid(child, 0)[1], 0)"
    assert run_package(package, script=code) == (0.0, 0)
    assert run_package(package) == (14.0, 1)


def test_settings_of_the_compiler_and_other_sources_have_machine_code_of_their_own(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two versions of a package that are used in turn do not replace each other's machine code."""
    assert import_package() == (14.0, 0)
    with monkeypatch.context() as settings:
        settings.setenv("NUMBA_BOUNDSCHECK", "1")
        assert import_package() == (14.0, 0)
    edit(package / "numbers_.py", "1.0", "3.0")
    assert import_package() == (18.0, 0)
    edit(package / "numbers_.py", "3.0", "1.0")
    assert import_package() == (14.0, 1)


def test_a_damaged_file_is_compiled_anew(package: Path) -> None:
    assert import_package() == (14.0, 0)
    for file in (package.parent / "cache").rglob("*.nbc"):
        file.write_bytes(file.read_bytes()[:100])
    assert import_package() == (14.0, 0)
    assert import_package() == (14.0, 1)


def test_without_compilation_the_functions_are_those_of_python(package: Path) -> None:
    code = "from bench_package.outer import Pair, total\nfrom harness.core.compiled import specialise\n"
    code += "print(specialise(total, Pair(1.0, 10.0))(Pair(1.0, 10.0)), 0)"
    assert run_package(package, script=code, NUMBA_DISABLE_JIT="1") == (14.0, 0)


def test_two_processes_at_the_same_time_compile_a_function_once(package: Path) -> None:
    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(run_package, [package, package]))
    assert sorted(results) == [(14.0, 0), (14.0, 1)]
    assert not list(package.parent.rglob("*.lock"))


def test_a_function_whose_compilation_fails_is_unlocked(package: Path) -> None:
    edit(package / "inner.py", "return x + STEP", "return x + undefined")
    with pytest.raises(TypingError):
        import_package()
    assert not list(package.parent.rglob("*.lock"))


_FACTOR = 2.0


@compiled
def scale(values: Floats) -> Floats:
    out: Floats = _FACTOR * values
    return out


def double(x: int) -> int:
    return 2 * x


def test_only_these_functions_are_compiled_at_the_lower_level() -> None:
    levels = []

    class Listener(event.Listener):
        def on_start(self, event: Any) -> None:
            levels.append(int(_config.OPT))

        def on_end(self, event: Any) -> None:
            pass

    before = _config.OPT
    without_file = FunctionType(double.__code__.replace(co_filename="<none>"), {"__name__": "none"})
    with event.install_listener("numba:compile", Listener()):
        assert compiled(without_file)(3) == 6  # machine code of it is on no disk
    assert (levels[0], _config.OPT) == (1, before)


def test_the_stamp_follows_the_constants(monkeypatch: pytest.MonkeyPatch) -> None:
    before = module_stamp(globals())
    assert module_stamp(globals()) == before
    monkeypatch.setitem(globals(), "_FACTOR", 3.0)
    assert module_stamp(globals()) != before


def test_a_specialised_function_gives_the_same_result() -> None:
    values = np.arange(3.0)
    np.testing.assert_array_equal(specialise(scale, values)(values), scale(values))
