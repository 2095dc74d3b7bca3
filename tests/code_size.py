"""Sizes of the package and of its documents: `python -m tests.code_size [CHECKOUT]` prints them.

Code lines count no docstrings, comments or blank lines. The figures of two checkouts can be compared.
"""

import ast
import io
import sys
import tokenize
from collections import Counter
from pathlib import Path

from tests.test_prose import LONGEST_SENTENCE, ROOT, sentences, words

LONG_FUNCTION = 30
"""Lines."""
_NO_CODE = {
    *(tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER),
}


def code_lines(source: str) -> int:
    """Number of lines with code."""
    docstrings = {
        line
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Expr) and _is_docstring(node)
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    lines = {n for t in tokens if t.type not in _NO_CODE for n in range(t.start[0], t.end[0] + 1)}
    return len(lines - docstrings)


def _is_docstring(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def package_sizes(root: Path) -> dict[str, int]:
    """Code lines by folder, and counts of statements, long functions and class names that occur twice."""
    sizes, names = Counter[str](), Counter[str]()
    for path in sorted((root / "harness").rglob("*.py")):
        source, folder = path.read_text(encoding="utf-8"), path.relative_to(root / "harness").parts[0]
        lines = code_lines(source)
        sizes[f"code lines, {folder if not folder.endswith('.py') else 'top'}"] += lines
        sizes["code lines"] += lines
        for node in ast.walk(ast.parse(source)):
            sizes["statements"] += isinstance(node, ast.stmt) and not _is_docstring(node)
            if isinstance(node, ast.FunctionDef):
                sizes[f"functions over {LONG_FUNCTION} lines"] += (node.end_lineno or 0) - node.lineno >= LONG_FUNCTION
            names.update([node.name] if isinstance(node, ast.ClassDef) else [])
    sizes["class names that occur twice"] = sum(count > 1 for count in names.values())
    return dict(sizes)


def document_sizes(root: Path) -> dict[str, int]:
    """Sentences of the README and of all documents, and how many are long."""
    sizes = {}
    for name, pages in {"README": [root / "README.md"], "docs": sorted((root / "docs").rglob("*.md"))}.items():
        found = [words(s) for page in pages for s in sentences(page.read_text(encoding="utf-8"))]
        sizes[f"sentences, {name}"] = len(found)
        sizes[f"sentences over {LONGEST_SENTENCE} words, {name}"] = sum(count > LONGEST_SENTENCE for count in found)
    return sizes


if __name__ == "__main__":
    checkout = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT
    for what, size in {**package_sizes(checkout), **document_sizes(checkout)}.items():
        print(f"{size:8,}  {what}")
