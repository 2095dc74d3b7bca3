"""Files that determine what a method computes: its code, and the data files that it declares.

Their hash is part of a cell's key. The code of a method is every module that it imports from its own package or folder.
Its data files are those of its attribute `files`, relative to the file that defines the attribute.
"""

import ast
import hashlib
import inspect
import os
import site
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from types import ModuleType

from harness.core.cache_folder import cache_folder
from harness.core.input_file import check_input_file
from harness.core.package_data import PACKAGE_FOLDER
from harness.errors import BadInput
from harness.reconstruct.contract import Method

_MODULE_SUFFIXES = (".py", *EXTENSION_SUFFIXES)
_IMPORTERS = ("import_module", "__import__")


@dataclass(frozen=True)
class SourceFiles:
    """Files of one method; the package's own are left out, because every key contains their hash anyway."""

    folders: tuple[Path, ...]
    """Own folders: those of the method, and of the methods that it wraps."""
    files: tuple[Path, ...]
    """Code and declared data files."""

    def digest(self) -> str:
        """Hash of the names and contents of all files; BadInput when one cannot be read."""
        state = hashlib.blake2b(digest_size=16)
        for file in self.files:
            near = next((folder for folder in self.folders if file.is_relative_to(folder)), file.parent)
            state.update(f"{file.relative_to(near).as_posix()}\0".encode())
            try:
                with open(file, "rb") as content:
                    state.update(hashlib.file_digest(content, "blake2b").digest())
            except OSError as error:
                raise BadInput(
                    f"{file} cannot be read ({error.strerror}).", "A cell's key covers its content."
                ) from error
        return state.hexdigest()


def source_hash(method: Method) -> str:
    """Hash of a method's class, of the classes that it wraps, and of their files; BadInput when a file is missing."""
    state = hashlib.blake2b(digest_size=16)
    for part in _wrapped(method):
        state.update(f"{type(part).__module__}:{type(part).__qualname__}\0{source_files(part).digest()}\0".encode())
    return state.hexdigest()


def source_files(method: object, modules: Iterable[ModuleType] = ()) -> SourceFiles:
    """Files of a method and of the methods that it wraps; BadInput when one does not exist.

    `modules` adds loaded modules that lie in its own folders, which a search of its source may not find.
    """
    folders: dict[Path, None] = {}
    files: set[Path] = set()
    for part in _wrapped(method):
        file = _defining_file(type(part))
        if is_below(file, [PACKAGE_FOLDER]):
            continue
        package = _top_package(type(part).__module__, file)
        root = package.parent if package else file.parent
        installed = is_below(root, library_folders())
        own = (package or file) if installed else root
        folders[own] = None
        files |= {file, *_code_below(package)} if package else {file}
        files |= _imported_files(file, root, packages=not installed) | set(_declared_files(part))
        places = (Path(os.path.abspath(path)) for m in modules if (path := getattr(m, "__file__", None)))
        files |= {place for place in places if is_below(place, [own]) and not is_below(place, foreign_folders())}
    return SourceFiles(tuple(folders), tuple(sorted(files)))


def is_below(path: Path, folders: Iterable[Path]) -> bool:
    """Whether a path is one of the folders or lies below one."""
    return any(path.is_relative_to(folder) for folder in folders)


@cache
def library_folders() -> tuple[Path, ...]:
    """Folders of the standard library and of installed packages, as named and with links resolved."""
    named = [sysconfig.get_path(kind) for kind in ("stdlib", "platstdlib", "purelib", "platlib")]
    named += [site.getusersitepackages(), *site.getsitepackages()]
    return tuple(dict.fromkeys(p for name in named if name for p in (Path(name).absolute(), Path(name).resolve())))


@cache
def foreign_folders() -> tuple[Path, ...]:
    """Folders whose files are no method's own: the harness, its data and cache, Python and installed packages."""
    ours = [PACKAGE_FOLDER, *(PACKAGE_FOLDER.parent / name for name in ("models", "scenarios"))]
    ours += [folder for folder in [cache_folder()] if folder is not None]
    python = [Path(prefix) for prefix in (sys.prefix, sys.base_prefix)]
    return tuple(dict.fromkeys([*ours, *python, *(p.resolve() for p in (*ours, *python)), *library_folders()]))


def _wrapped(method: object) -> Iterator[object]:
    """A method, the one that it wraps, and so on."""
    while hasattr(method, "fit"):
        yield method
        method = getattr(method, "method", None)


def _defining_file(kind: type) -> Path:
    try:
        found = inspect.getsourcefile(kind)
    except TypeError:
        found = None
    if found is None or not Path(found).is_file():
        raise BadInput(f"The source of {kind.__name__} cannot be found.", "Define the method in a file.")
    return Path(os.path.abspath(found))


def _top_package(module: str, file: Path) -> Path | None:
    """The folder of the outermost package of a module; None for a module outside packages."""
    top = sys.modules.get(module.partition(".")[0])
    places = [Path(os.path.abspath(place)) for place in getattr(top, "__path__", ())]
    return next((place for place in places if file.is_relative_to(place)), None)


def _code_below(folder: Path) -> set[Path]:
    return {file for suffix in _MODULE_SUFFIXES for file in folder.rglob(f"*{suffix}") if file.is_file()}


def _imported_files(file: Path, root: Path, *, packages: bool) -> set[Path]:
    """The module files that a file imports from the folders of `sys.path` in its own folder, recursively.

    Without `packages`, as among installed packages, only modules next to the file count.
    """
    paths = [Path(os.path.abspath(entry)) for entry in sys.path] if packages else []
    roots = dict.fromkeys([root, *(path for path in paths if is_below(path, [root]) and path.is_dir())])
    found, waiting = set[Path](), [file]
    while waiting:
        current = waiting.pop()
        if current in found or is_below(current, foreign_folders() if packages else [PACKAGE_FOLDER]):
            continue
        found.add(current)
        if current.suffix == ".py":
            for name in _imported_names(current, root):
                waiting += [part for place in roots for part in _module_files(place, name, packages)]
    return found


def _imported_names(file: Path, root: Path) -> Iterator[str]:
    """Names of the modules that a file may import, wherever in the file; relative ones are made absolute."""
    try:
        nodes = list(ast.walk(ast.parse(file.read_bytes())))
    except (SyntaxError, ValueError, RecursionError):
        return  # it cannot be imported either; its content counts
    package = file.parent.relative_to(root).parts if file.is_relative_to(root) else ()
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else ()
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield from (base, *(f"{base}.{alias.name}".lstrip(".") for alias in node.names))
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", getattr(node.func, "id", "")) in _IMPORTERS:
            yield from (a.value for a in node.args[:1] if isinstance(a, ast.Constant) and isinstance(a.value, str))


def _module_files(root: Path, name: str, packages: bool) -> Iterator[Path]:
    """Files of a module and of the packages around it, as far as they lie below a folder."""
    parts = [part for part in name.split(".") if part.isidentifier()]
    for count in range(1, len(parts) + 1 if packages else min(len(parts), 1) + 1):
        place = root.joinpath(*parts[:count])
        inside = place / "__init__.py"
        candidates = [place.with_name(place.name + suffix) for suffix in _MODULE_SUFFIXES]
        yield from (file for file in (*candidates, *([inside] if packages else [])) if file.is_file())


def _declared_files(method: object) -> Iterator[Path]:
    """The files of a method's attribute `files`; a folder stands for all files below it."""
    declared = getattr(method, "files", ())
    if isinstance(declared, str) or not all(isinstance(name, str | Path) for name in declared):
        raise BadInput(f"{type(method).__name__}.files is {declared!r}.", 'Write a list of paths: files = ["a.npz"].')
    owner = next((kind for kind in type(method).__mro__ if "files" in vars(kind)), type(method))
    for name in declared:
        path = Path(os.path.abspath(_defining_file(owner).parent / name))
        if not path.exists():
            raise BadInput(f"{type(method).__name__} declares {path}, which does not exist.", "Correct `files`.")
        for file in sorted(path.rglob("*")) if path.is_dir() else (path,):
            if file.exists() and not file.is_dir():
                check_input_file(file, f"a data file of {type(method).__name__}", sys.maxsize, "Correct `files`.")
                yield file
