"""The language of the documents and docstrings: sentence lengths, line lengths and where docstrings stand."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import harness

PACKAGE = Path(harness.__file__).parent
ROOT = PACKAGE.parent
LONGEST_SENTENCE = 40
"""Words."""
LONGEST_LINE = 120
"""Characters; tables are excepted."""
DOCUMENTS = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
TABLES = {ROOT / "results" / "README.md"}
"""Pages that `harness report --readme` writes: they hold tables, not prose."""
ELLIPTICAL = re.compile(
    r"^(The same|The other|The rest|Of (so|all|each|every|one|what|the|a)\b|As (above|before|it|they)|Likewise|Whoever|"
    r"Whatever|What (is|was|has|they|it)\b.*said|So many|How it is said)"
)
"""Beginnings of docstrings that cannot be read alone."""


def prose(text: str) -> str:
    """A page without code blocks, tables, formulas, pictures and the markup of links."""
    text = re.sub(r"^(```|~~~).*?^(```|~~~)\s*$", "\n", text, flags=re.M | re.S)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    text = re.sub(r"\$\$.*?\$\$", ".", text, flags=re.S)
    lines = [line for line in text.splitlines() if not re.match(r"\s*\||    \S|\s*!\[", line)]
    text = "\n".join(lines)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return re.sub(r"`[^`]*`", "CODE", text)


def sentences(text: str) -> Iterator[str]:
    """Sentences of a page. A paragraph, list item or heading ends one as well; a semicolon does not."""
    for block in re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.)\s)|\n(?=#)|(?<=\n)#+ .*\n", prose(text)):
        joined = " ".join(block.split())
        for sentence in re.split(r"(?<=[.!?])[\"')*]*\s+(?=[\"'(*`A-Z0-9$])", joined):
            if sentence.strip():
                yield sentence.strip()


def words(sentence: str) -> int:
    return len(re.findall(r"[A-Za-z][\w'’-]*|\d[\d.,]*", sentence))


def test_the_counter_counts() -> None:
    page = (
        "# A title\n\nOne two; three four. Five `a b c` six.\n\n- An item\n- Another. Item\n\n    code here\n\n| a |\n"
    )
    assert [words(s) for s in sentences(page)] == [2, 4, 3, 2, 1, 1]


def test_no_sentence_of_the_readme_is_long() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert [s for s in sentences(text) if words(s) > LONGEST_SENTENCE] == []
    assert len(text.splitlines()) <= 110


def test_no_sentence_of_the_docs_is_long() -> None:
    every = [(page, s) for page in DOCUMENTS for s in sentences(page.read_text(encoding="utf-8"))]
    long = [(page.name, s) for page, s in every if words(s) > LONGEST_SENTENCE]
    assert len(every) > 200
    assert not long, f"{len(long)} of {len(every)}: {long}"


@pytest.mark.parametrize("page", DOCUMENTS, ids=lambda page: str(page.relative_to(ROOT)))
def test_lines_of_documents_fit(page: Path) -> None:
    code, long = False, []
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        code ^= line.startswith("```")
        if len(line) > LONGEST_LINE and not code and not line.lstrip().startswith(("|", "$$", "![")):
            long.append(number)
    assert not long, f"{page.relative_to(ROOT)}: lines {long}"


def docstrings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Line and text of every docstring: of modules, classes, functions, and of attributes and constants."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            for statement in node.body:
                match statement:
                    case ast.Expr(value=ast.Constant(value=str() as text)):
                        yield statement.lineno, text


def test_no_docstring_is_elliptical() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}: {text.strip().splitlines()[0]}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for line, text in docstrings(ast.parse(path.read_text(encoding="utf-8")))
        if text.strip() and ELLIPTICAL.match(text.strip())
    ]
    assert found == []


def test_every_attribute_docstring_follows_its_assignment() -> None:
    """A string in a class or module that is not its first statement documents the assignment right above it."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Module | ast.ClassDef):
                continue
            for before, statement in zip(node.body, node.body[1:], strict=False):
                if not (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)):
                    continue
                if isinstance(statement.value.value, str) and not isinstance(before, ast.Assign | ast.AnnAssign):
                    found.append(f"{path.relative_to(ROOT)}:{statement.lineno}")
    assert found == []
