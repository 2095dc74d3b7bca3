"""Functions that numba compiles to machine code at their first call and keeps on disk between runs.

They serve loops over stations and joints, where one call of numpy costs more than the numbers it works on. A compiled
function takes numbers, arrays and named tuples of them. It may call compiled functions of its own and of other modules,
and it may use their constants.

The machine code of a function contains everything that the function calls, but numba checks only the function's own
file before it loads that code from disk. Here the check covers the file, the compiled modules that it imports, directly
or not, and the values of constants.

Compiling everything takes most of the first run. Processes that run at the same time therefore share the work: while
one compiles a function, others that need it wait for the machine code. LLVM optimises at level 1 of 3: that saves a
sixth of the time, and the loops here run as fast (within 1 %) with the same results to the bit.

Machine code lies in a private folder of the user (`core.cache_folder`), in a folder for each key of a module.
"""

import hashlib
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar, cast

import numpy as np
from filelock import FileLock, Timeout

from harness.core.cache_folder import MACHINE_CODE, cache_folder, keep_newest
from harness.core.working_folder import plain_import

with plain_import():
    import numba
    from numba.core import caching, config
    from numba.core.dispatcher import Dispatcher

F = TypeVar("F", bound=Callable[..., Any])
_FunctionCache: Any = caching.FunctionCache  # numba has no types
_CacheImpl: Any = caching.CompileResultCacheImpl
_IndexFile: Any = caching.IndexDataCacheFile
_config: Any = config
_config._config_fname = os.devnull  # numba reads its settings again before each compilation: none of a folder

_OPTIMISATION_LEVEL = _config._OptLevel(1)
_LONGEST_COMPILATION_S = 120.0
"""Time after which a process no longer waits for one that compiles the same function [s]."""
_KEPT_KEYS = 8
"""Number of keys whose machine code is kept for each module: versions of the harness, of Python and of processors."""
_source_hashes: dict[str, bytes] = {}
"""SHA-256 of the file of each compiled module, by module name; read while the module is imported, for it may change."""


def compiled(function: F) -> F:
    """A compiled version of a function, with IEEE arithmetic in the written order: results stay the same to the bit.

    It releases the interpreter lock, so a thread that reads a tracker does not wait for one that solves. Without a
    private folder or a source file, every process compiles anew. NUMBA_DISABLE_JIT leaves the function as it is.
    """
    if _config.DISABLE_JIT:
        return function
    dispatcher: Any = numba.njit(error_model="numpy", nogil=True)(function)
    with suppress(OSError):  # no source file
        module = function.__module__
        if module not in _source_hashes:
            _source_hashes[module] = hashlib.sha256(Path(function.__code__.co_filename).read_bytes()).digest()
        dispatcher._cache = _ModuleCache(function)
    dispatcher.compile = partial(_compile, dispatcher)
    return cast(F, dispatcher)


def specialise(function: F, *arguments: Any) -> F:
    """A compiled function for arguments of exactly these types, for loops that always pass the same arrays.

    It skips the inspection of argument types, which takes longer than a small task does. Arguments of any other type
    are misread without an error.
    """
    if not isinstance(function, Dispatcher):
        return function
    return cast(F, function.compile(tuple(map(numba.typeof, arguments))))


def _compile(dispatcher: Any, signature: Any) -> Any:
    """Compile a function for a signature, or load its machine code; numba calls this before the first call."""
    try:
        with _optimisation_level():
            return Dispatcher.compile(dispatcher, signature)
    finally:
        if isinstance(dispatcher._cache, _ModuleCache):
            dispatcher._cache.release()


@contextmanager
def _optimisation_level() -> Iterator[None]:
    """Compile at this module's level; other users of numba in the same process keep theirs."""
    before = _config.OPT
    _config.OPT = _OPTIMISATION_LEVEL
    try:
        yield
    finally:
        _config.OPT = before


class _CodeFormat(_CacheImpl):  # type: ignore[misc]  # its base is Any: numba leaves it untyped
    """How numba writes a compiled function, without its search for a folder."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._locator, self._py_file = self, function.__code__.co_filename
        self._lineno = function.__code__.co_firstlineno


class _ModuleCache(_FunctionCache):  # type: ignore[misc]  # its base is Any: numba leaves it untyped
    """numba's cache on disk, in a folder whose name covers all that the machine code of a module depends on.

    The folder is chosen and the lock is made at the first call: a process that is forked before it has its own.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._name, self._py_func, self._impl = repr(function), function, _CodeFormat(function)
        self._cache_path: Path | None = None
        self._cache_file: Any = None
        self._lock: FileLock | None = None
        self.enable()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The machine code from disk, or None; numba calls this before it compiles, and so before it saves.

        With None this process holds the lock of the function until `release`. It waits while another one compiles.
        """
        target_context.refresh()
        if not self._open(target_context.codegen().magic_tuple()):
            return None
        found = self._load(sig, target_context)
        if found is None and self._lock is None:
            # A file system without locks, a process that was stopped: compile all the same.
            with suppress(OSError, NotImplementedError, Timeout):
                lock = FileLock(f"{self._cache_file._index_path}.lock", timeout=_LONGEST_COMPILATION_S)
                lock.acquire()
                self._lock = lock
                found = self._load(sig, target_context)
        return found

    def _open(self, target: Any) -> bool:
        """Choose the folder of the module for a processor, and make it; False where there is none."""
        root, code = cache_folder(), self._py_func.__code__
        if root is None:
            return False
        module = self._py_func.__module__
        key = _machine_key(module_stamp(self._py_func.__globals__), target)
        self._cache_path = root / MACHINE_CODE / module / key
        with suppress(OSError):
            if self._cache_path.is_dir():
                os.utime(self._cache_path)
            else:
                self._cache_path.mkdir(parents=True)
                keep_newest(self._cache_path.parent, _KEPT_KEYS)
            name = f"{self._py_func.__qualname__}-{code.co_firstlineno}".replace("<", "").replace(">", "")
            self._cache_file = _IndexFile(self._cache_path, name, key)
            return True
        return False

    def _load(self, sig: Any, target_context: Any) -> Any:
        try:
            return self._load_overload(sig, target_context)
        except Exception:  # a damaged file, one of another version of a library, or a class that has been renamed
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save machine code; a folder that cannot be written costs the next process a compilation, and no more."""
        with suppress(OSError):
            if self._cache_file is not None and self._impl.check_cachable(data):
                self._cache_file.save(self._index_key(sig, data.codegen), self._impl.reduce(data))

    def release(self) -> None:
        """Let other processes load what was compiled."""
        lock, self._lock = self._lock, None
        if lock is not None:
            lock.release()
            with suppress(OSError):
                Path(lock.lock_file).unlink()


def _machine_key(stamp: str, target: Any) -> str:
    """Name for the machine code of a module: its stamp, versions of Python and compiler, settings, the processor."""
    settings = sorted((k, v) for k, v in os.environ.items() if k.startswith("NUMBA_") and "CACHE" not in k)
    versions = sys.implementation.cache_tag, numba.__version__, np.__version__
    return hashlib.sha256(repr((stamp, versions, settings, target)).encode()).hexdigest()[:32]


def module_stamp(namespace: Mapping[str, Any]) -> str:
    """Hexadecimal digest of everything that the machine code of a module depends on, from the module's globals."""
    digest = hashlib.sha256()
    _add_module(digest, namespace, set())
    return digest.hexdigest()


def _add_module(digest: Any, namespace: Mapping[str, Any], visited: set[str]) -> None:
    """Add a module's source, constants and records, and the modules behind its compiled functions and imports."""
    module = namespace["__name__"]
    if module in visited:
        return
    visited.add(module)
    digest.update(module.encode() + _source_hashes.get(module, b""))
    for name, value in sorted(namespace.items()):
        if name.startswith("__"):
            continue
        if isinstance(value, Dispatcher):
            _add_module(digest, value.py_func.__globals__, visited)
        elif isinstance(value, ModuleType) and value.__name__.split(".")[0] == module.split(".")[0]:
            _add_module(digest, vars(value), visited)
        elif isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields"):
            digest.update(repr((name, value.__module__, value._fields)).encode())
        elif isinstance(value, np.ndarray) and value.dtype != object:
            digest.update(repr((name, value.dtype, value.shape)).encode() + value.tobytes())
        elif _is_constant(value):
            digest.update(repr((name, value)).encode())


def _is_constant(value: Any) -> bool:
    """Whether a value is a number, a text, or a tuple of such."""
    if isinstance(value, tuple):
        return all(map(_is_constant, value))
    return isinstance(value, bool | int | float | complex | str | bytes | np.generic)
