"""Sizes of the package and of its documents: `python -m tests.code_size [CHECKOUT]` prints them.

Code lines count no docstrings, comments or blank lines. The figures of two checkouts can be compared. `python -m
tests.code_size --write` sets the limits of tests/code_budget.toml to today's sizes, and prints the line that
docs/CHANGELOG.md needs (tests/test_code_size.py).
"""

import ast
import sys
import tomllib
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TypeGuard

from tests.test_prose import LONGEST_SENTENCE, ROOT, sentences, words

LONG_FUNCTION = 30
"""Lines."""
BUDGET = Path(__file__).with_name("code_budget.toml")
"""Most code lines of each folder of `harness/`, of the files beside them, and of `tests/`."""
_STEP = 50
"""Limits are multiples of this many lines, so that a mended fault need not raise one [choice]."""


def code_lines(source: str) -> int:
    """Number of lines with code. Every line of a text of several lines counts, unless the text is a docstring."""
    docstrings, texts = set[int](), set[int]()
    for node in ast.walk(ast.parse(source)):
        if _is_docstring(node):
            docstrings.update(_lines(node))
        elif isinstance(node, ast.Constant | ast.JoinedStr):
            texts.update(_lines(node))
    rows = ((number, line.strip()) for number, line in enumerate(source.split("\n"), 1))
    written = {number for number, line in rows if line and not line.startswith("#")}
    return len((written | texts) - docstrings)


def _lines(node: ast.expr | ast.Expr) -> range:
    return range(node.lineno, (node.end_lineno or node.lineno) + 1)


def _is_docstring(node: ast.AST) -> TypeGuard[ast.Expr]:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def package_sizes(root: Path) -> dict[str, int]:
    """Code lines by folder, and counts of statements, files, classes and long functions."""
    sizes, names = Counter[str](), Counter[str]()
    for path in sorted((root / "harness").rglob("*.py")):
        source, folder = path.read_text(encoding="utf-8"), path.relative_to(root / "harness").parts[0]
        lines = code_lines(source)
        sizes[f"code lines, {folder if not folder.endswith('.py') else 'top'}"] += lines
        sizes["code lines"] += lines
        sizes["files"] += 1
        for node in ast.walk(ast.parse(source)):
            sizes["statements"] += isinstance(node, ast.stmt) and not _is_docstring(node)
            if isinstance(node, ast.FunctionDef):
                sizes[f"functions over {LONG_FUNCTION} lines"] += (node.end_lineno or 0) - node.lineno >= LONG_FUNCTION
            if isinstance(node, ast.ClassDef):
                names[node.name] += 1
                sizes["dataclasses"] += any("dataclass" in ast.unparse(each) for each in node.decorator_list)
    sizes["classes"] = names.total()
    sizes["class names that occur twice"] = sum(count > 1 for count in names.values())
    return dict(sizes)


def budgeted_sizes(root: Path) -> dict[str, int]:
    """Code lines of each folder of `harness/`, of the files beside them (`top`), and of `tests/`."""
    sizes = Counter[str]()
    for path in (root / "harness").rglob("*.py"):
        folder = path.relative_to(root / "harness").parts[0]
        sizes["top" if folder.endswith(".py") else folder] += code_lines(path.read_text(encoding="utf-8"))
    tests = sum(code_lines(path.read_text(encoding="utf-8")) for path in (root / "tests").rglob("*.py"))
    return {**dict(sorted(sizes.items())), "tests": tests}


def read_budget() -> dict[str, int]:
    """Folder -> most code lines."""
    budget: dict[str, int] = tomllib.loads(BUDGET.read_text(encoding="utf-8"))
    return budget


def budget_line(budget: Mapping[str, int]) -> str:
    """The beginning of the line of docs/CHANGELOG.md that belongs to a budget."""
    tests = budget["tests"]
    return f"- Code lines: at most {sum(budget.values()) - tests:,} in `harness/` and {tests:,} in `tests/`."


def write_budget(root: Path) -> None:
    """Set the limits to today's sizes, rounded up, and print the line that the changelog needs."""
    budget = {name: -(-lines // _STEP) * _STEP for name, lines in budgeted_sizes(root).items()}
    head = "# Most code lines of each folder. `python -m tests.code_size --write` sets them.\n"
    BUDGET.write_text(head + "".join(f"{name} = {lines}\n" for name, lines in budget.items()), encoding="utf-8")
    print(f"{BUDGET}: written. docs/CHANGELOG.md needs:\n{budget_line(budget)} Grown for: WHAT. Gone: WHAT.")


def document_sizes(root: Path) -> dict[str, int]:
    """Sentences of the README and of all documents, and how many are long."""
    sizes = {}
    for name, pages in {"README": [root / "README.md"], "docs": sorted((root / "docs").rglob("*.md"))}.items():
        found = [words(s) for page in pages for s in sentences(page.read_text(encoding="utf-8"))]
        sizes[f"sentences, {name}"] = len(found)
        sizes[f"sentences over {LONGEST_SENTENCE} words, {name}"] = sum(count > LONGEST_SENTENCE for count in found)
    return sizes


def main(words: list[str]) -> None:
    if words == ["--write"]:
        write_budget(ROOT)
        return
    checkout = Path(words[0]) if words else ROOT
    for what, size in {**package_sizes(checkout), **document_sizes(checkout)}.items():
        print(f"{size:8,}  {what}")


if __name__ == "__main__":
    main(sys.argv[1:])
