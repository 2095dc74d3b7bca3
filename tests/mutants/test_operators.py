"""Each operator on a few lines of source, and what is never mutated."""

import ast

import pytest

from tests.mutants.operators import OPERATORS, mutations


def changed(operator: str, source: str) -> list[str]:
    """The source after each mutation of an operator."""
    return [m.apply(source) for m in mutations("a.py", source) if m.operator == operator]


EXPRESSIONS = [
    ("comparison", "a < b <= c", ["a > b <= c", "a < b >= c"]),
    ("comparison", "(a) == (b)", ["(a) != (b)"]),
    ("comparison", "a is  not b", ["a is b"]),
    ("comparison", "a in b", ["a not in b"]),
    ("boundary", "a < b == c >= d", ["a <= b == c >= d", "a < b == c > d"]),
    ("plus_minus", "a + (b - c)", ["a - (b - c)", "a + (b + c)"]),
    ("times_divide", "a * b // c % d", ["a / b // c % d", "a * b * c % d", "a * b // c * d"]),
    ("times_divide", "a**2", ["a*2"]),
    ("sign", "f(-a)", ["f(a)"]),
    ("sign", "-(a + b)", ["(a + b)"]),
    ("sign", "-(-a)", ["(-a)", "-(a)"]),
    ("constant", "x + 7", ["x + 8"]),
    ("constant", "(0.0, 2.5, 0)", ["(1.0, 2.5, 0)", "(0.0, 5.0, 0)", "(0.0, 2.5, 1)"]),
    ("constant", "f(True)", ["f(False)"]),
    ("constant", "f('7', None, b'7')", []),
    ("and_or", "a and b and (c or d)", ["a or b and (c or d)", "a and b or (c or d)", "a and b and (c and d)"]),
    ("negation", "a if b else c", ["a if (not (b)) else c"]),
    ("negation", "[a for a in b if c]", ["[a for a in b if (not (c))]"]),
    ("swapped_arguments", "f(a, g(b), k=c)", ["f(g(b), a, k=c)"]),
    ("swapped_arguments", "f(a, a)", []),
    ("swapped_arguments", "f(*a, b)", []),
    ("swapped_arguments", "min(a, b) + np.maximum(c, d)", []),
    ("plus_minus", "'µ' + µ", ["'µ' - µ"]),
]


@pytest.mark.parametrize(("operator", "before", "after"), EXPRESSIONS)
def test_expressions(operator: str, before: str, after: list[str]) -> None:
    assert sorted(changed(operator, before)) == sorted(after)


def function(body: str, returns: str = "float") -> str:
    return f"def f(x: int) -> {returns}:\n    {body}\n"


STATEMENTS = [
    ("plus_minus", "x += 1", ["x -= 1"]),
    ("times_divide", "x *= y", ["x /= y"]),
    ("negation", "if x: y = 1", ["if (not (x)): y = 1"]),
    ("dropped_statement", "g(x)", ["pass"]),
    ("dropped_statement", "x = g(x)", ["pass"]),
    ("dropped_statement", "x.y[0] = 1", ["pass"]),
    ("dropped_statement", "x += 1", ["pass"]),
    ("dropped_statement", "y = g(x)", []),  # a new name: dropping it would be noticed by its use
    ("dropped_statement", "return x", []),
]


@pytest.mark.parametrize(("operator", "before", "after"), STATEMENTS)
def test_statements(operator: str, before: str, after: list[str]) -> None:
    assert changed(operator, function(before)) == [function(line) for line in after]


def test_a_name_can_be_dropped_once_it_has_a_value() -> None:
    source = "def f(x):\n    y = 1\n    if x:\n        y = 2\n    return y\n"
    assert changed("dropped_statement", source) == [source.replace("y = 2", "pass")]


@pytest.mark.parametrize(
    ("returns", "text"),
    [("float", "0.0"), ("int", "0"), ("str", '""'), ("bool", "not (g(x))"), ("Body | None", "None"), ("Body", "")],
)
def test_returned_defaults(returns: str, text: str) -> None:
    source = function("return g(x)", returns)
    assert changed("returned_default", source) == ([source.replace("g(x)", text)] if text else [])
    assert changed("returned_default", function("return 0", "int")) == []


EXEMPT = '''"""A docstring."""
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    LIMIT = 7


class A(Base[3]):
    x: Literal[5]
    """A field."""

    @decorated(2)
    def f(self, y: Literal[1]) -> Literal[9]:
        """A method."""
        raise ValueError(f"{y + 1}", y - 1)


def g(y: int) -> str:
    return f"{y + 1} metres"
'''


def test_texts_annotations_errors_and_type_checking_are_exempt() -> None:
    assert [m for m in mutations("a.py", EXEMPT) if m.operator != "returned_default"] == []


def test_a_default_of_a_field_or_of_an_argument_is_not() -> None:
    source = "class A:\n    x: int = 5\n\ndef f(y: int = 6) -> None: ...\n"
    assert changed("constant", source) == [source.replace("5", "6", 1), source.replace("= 6", "= 7")]


def test_a_mutation_knows_its_line_and_keeps_all_others() -> None:
    source = "# a comment\nx = f(\n    a,  # first\n    b - 1,\n)\n"
    (swap,) = [m for m in mutations("a.py", source) if m.operator == "swapped_arguments"]
    assert (swap.number, swap.line) == (3, "a,  # first")
    assert swap.apply(source) == "# a comment\nx = f(\n    b - 1,  # first\n    a,\n)\n"
    (minus,) = [m for m in mutations("a.py", source) if m.operator == "plus_minus"]
    assert (minus.number, minus.line, minus.mutant) == (4, "b - 1,", "b + 1,")
    assert str(minus) == "a.py:4 plus_minus: b - 1, -> b + 1,"


def test_the_table_names_every_operator() -> None:
    tried = {operator for operator, _, _ in [*EXPRESSIONS, *STATEMENTS]} | {"returned_default"}
    assert tried == set(OPERATORS)


def test_mutated_source_is_still_python() -> None:
    source = "def f(x: float) -> float:\n    return (-x if x < 0 and not x else g(x, 2) * 3) + x**2\n"
    found = [m.apply(source) for m in mutations("a.py", source)]
    assert len(found) > 10
    trees = {ast.dump(ast.parse(text)) for text in found}
    assert len(trees) == len(found)
    assert ast.dump(ast.parse(source)) not in trees


@pytest.mark.parametrize("source", ["-(a + b)", "-(-a)", "x = -(a - 2) * -(b)"])
def test_every_mutant_of_a_minus_sign_before_parentheses_parses(source: str) -> None:
    found = mutations("a.py", source)
    assert "sign" in {m.operator for m in found}
    for mutation in found:
        ast.parse(mutation.apply(source))
