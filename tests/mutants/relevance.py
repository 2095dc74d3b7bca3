"""The order in which test files are tried on a mutation: those that import the module first."""

from collections import Counter
from functools import cache
from pathlib import Path

Batch = tuple[str, ...]
"""Test files that one pytest process runs, relative to the checkout."""


class Suite:
    """The test files of a checkout."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._folders: dict[str, Batch] = {}
        for file in sorted((root / "tests").rglob("test_*.py")):
            folder = file.parent.relative_to(root).as_posix()
            self._folders[folder] = (*self._folders.get(folder, ()), file.relative_to(root).as_posix())
        self._folders.pop("tests/mutants", None)
        self._text = cache(lambda file: (root / file).read_text(encoding="utf-8"))

    def batches(self, module: str, *, near: bool) -> list[Batch]:
        """Batches for a module, such as "harness/score/angles.py".

        First the files that import it, then the folders of its package's tests, then the others by how often they name
        the module's folders. `near` leaves out what is not of the module's package.
        """
        path = Path(module)
        names = [".".join(path.with_suffix("").parts[:n]) for n in range(2, len(path.parts) + 1)]
        package = f"tests/{path.parts[1]}"
        mirrored = Path("tests", *path.parts[1:-1]).as_posix()
        mentions = Counter[str]()
        for folder, files in self._folders.items():
            mentions[folder] = sum(self._text(file).count(name) for file in files for name in names)

        def is_near(file_or_folder: str) -> bool:
            return f"{file_or_folder}/".startswith(f"{package}/")

        folders = sorted(self._folders, key=lambda f: (f != mirrored, not is_near(f), -mentions[f], f))
        direct = [file for folder in folders for file in self._folders[folder] if names[-1] in self._text(file)]
        direct.sort(key=lambda file: Path(file).stem != f"test_{path.stem}")
        if near:
            direct, folders = list(filter(is_near, direct)), list(filter(is_near, folders))
        return [*([tuple(direct)] if direct else []), *(self._folders[folder] for folder in folders)]
