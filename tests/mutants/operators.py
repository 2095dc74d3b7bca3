"""Mutation operators: what a mutation may change, and where in a file it may do so.

An operator replaces one span of the source; everything else stays as it is, so that line numbers and formatting do.
Docstrings and other texts, type annotations, raised errors, f-strings and `if TYPE_CHECKING` are never mutated.
"""

import ast
import io
import tokenize
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

Span = tuple[int, int]
"""First character of a change, and the one after its last."""
Change = tuple[Span, str]
"""A span and its new text."""


@dataclass(frozen=True)
class Mutation:
    """One change of one file."""

    file: str
    """Path relative to the checkout, with slashes."""
    number: int
    """Line number of the change's first character, from 1."""
    operator: str
    span: Span
    text: str
    """New text of the span."""
    line: str
    """Source line, stripped."""
    mutant: str
    """Lines of the change with the new text, stripped and joined by spaces."""

    def apply(self, source: str) -> str:
        return source[: self.span[0]] + self.text + source[self.span[1] :]

    def __str__(self) -> str:
        return f"{self.file}:{self.number} {self.operator}: {self.line} -> {self.mutant}"


class Source:
    """A parsed file: spans of nodes, and of the operators between them."""

    def __init__(self, text: str) -> None:
        self.text, self.tree = text, ast.parse(text)
        self._lines = text.splitlines(keepends=True)
        self._starts = [0]
        for line in self._lines:
            self._starts.append(self._starts[-1] + len(line))
        self._tokens = [
            ((self._starts[t.start[0] - 1] + t.start[1], self._starts[t.end[0] - 1] + t.end[1]), t.string)
            for t in tokenize.generate_tokens(io.StringIO(text).readline)
            if t.type in (tokenize.OP, tokenize.NAME)
        ]

    def span(self, node: ast.expr | ast.stmt) -> Span:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return self._at(node.lineno, node.col_offset), self._at(node.end_lineno, node.end_col_offset)

    def segment(self, node: ast.expr | ast.stmt) -> str:
        start, end = self.span(node)
        return self.text[start:end]

    def between(self, left: ast.expr | ast.stmt, right: ast.expr, operator: str) -> Span:
        """Span of an operator between two nodes; its words may be apart, as in "is  not"."""
        start, end = self.span(left)[1], self.span(right)[0]
        return self._words(start, end, operator.split())

    def before(self, statement: ast.stmt, value: ast.expr, operator: str) -> Span:
        """Span of the operator of an assignment, such as "+="."""
        return self._words(self.span(statement)[0], self.span(value)[0], [operator])

    def line_of(self, position: int) -> tuple[int, str]:
        """Number of the line at a position, and its text."""
        number = next(n for n, start in enumerate(self._starts) if start > position)
        return number, self._lines[number - 1]

    def lines_of(self, span: Span) -> tuple[int, int]:
        """Positions at which the lines of a span begin and end."""
        first, last = self.line_of(span[0])[0], self.line_of(max(span[1] - 1, span[0]))[0]
        return self._starts[first - 1], self._starts[last]

    def _words(self, start: int, end: int, words: list[str]) -> Span:
        inside = [(span, word) for span, word in self._tokens if start <= span[0] and span[1] <= end]
        for k in range(len(inside) - len(words) + 1):
            if [word for _, word in inside[k : k + len(words)]] == words:
                return inside[k][0][0], inside[k + len(words) - 1][0][1]
        raise ValueError(f"no {' '.join(words)!r} in {self.text[start:end]!r}")

    def _at(self, number: int, column: int) -> int:
        """Position of a column in bytes, as `ast` counts them."""
        line = self._lines[number - 1]
        return self._starts[number - 1] + len(line.encode()[:column].decode())


_COMPARISONS: Mapping[type[ast.cmpop], tuple[str, str]] = {
    ast.Lt: ("<", ">"),
    ast.LtE: ("<=", ">="),
    ast.Gt: (">", "<"),
    ast.GtE: (">=", "<="),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}
_BOUNDARIES: Mapping[type[ast.cmpop], tuple[str, str]] = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
}
_SUMS: Mapping[type[ast.operator], tuple[str, str]] = {ast.Add: ("+", "-"), ast.Sub: ("-", "+")}
_PRODUCTS: Mapping[type[ast.operator], tuple[str, str]] = {
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "*"),
    ast.Pow: ("**", "*"),
}


def _compare(node: ast.AST, source: Source, table: Mapping[type[ast.cmpop], tuple[str, str]]) -> Iterator[Change]:
    if isinstance(node, ast.Compare):
        for (left, right), operator in zip(pairwise([node.left, *node.comparators]), node.ops, strict=True):
            if type(operator) in table:
                before, after = table[type(operator)]
                yield source.between(left, right, before), after


def _arithmetic(node: ast.AST, source: Source, table: Mapping[type[ast.operator], tuple[str, str]]) -> Iterator[Change]:
    if isinstance(node, ast.BinOp) and type(node.op) in table:
        before, after = table[type(node.op)]
        yield source.between(node.left, node.right, before), after
    if isinstance(node, ast.AugAssign) and type(node.op) in table:
        before, after = table[type(node.op)]
        yield source.before(node, node.value, before + "="), after + "="


def comparison(node: ast.AST, source: Source) -> Iterator[Change]:
    yield from _compare(node, source, _COMPARISONS)


def boundary(node: ast.AST, source: Source) -> Iterator[Change]:
    yield from _compare(node, source, _BOUNDARIES)


def plus_minus(node: ast.AST, source: Source) -> Iterator[Change]:
    yield from _arithmetic(node, source, _SUMS)


def times_divide(node: ast.AST, source: Source) -> Iterator[Change]:
    yield from _arithmetic(node, source, _PRODUCTS)


def sign(node: ast.AST, source: Source) -> Iterator[Change]:
    """A minus sign is dropped."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        start = source.span(node)[0]
        yield (start, start + 1), ""


def constant(node: ast.AST, source: Source) -> Iterator[Change]:
    """n becomes n + 1; a number with a point is doubled, and 0.0 becomes 1.0; True and False are swapped."""
    if isinstance(node, ast.Constant):
        if isinstance(node.value, bool):
            yield source.span(node), str(not node.value)
        elif isinstance(node.value, int):
            yield source.span(node), str(node.value + 1)
        elif isinstance(node.value, float):
            yield source.span(node), repr(2.0 * node.value or 1.0)


def and_or(node: ast.AST, source: Source) -> Iterator[Change]:
    if isinstance(node, ast.BoolOp):
        before, after = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        for left, right in pairwise(node.values):
            yield source.between(left, right, before), after


def negation(node: ast.AST, source: Source) -> Iterator[Change]:
    """The condition of an `if`, of a conditional expression or of a comprehension is negated."""
    conditions = [node.test] if isinstance(node, ast.If | ast.IfExp) else []
    conditions += node.ifs if isinstance(node, ast.comprehension) else []
    for test in conditions:
        yield source.span(test), f"(not ({source.segment(test)}))"


def dropped_statement(node: ast.AST, source: Source) -> Iterator[Change]:
    """A call, a change in place, or an assignment to what has a value already becomes `pass`."""
    if isinstance(node, ast.FunctionDef):
        known = {argument.arg for argument in [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]}
        for statement in _statements(node):
            if _may_drop(statement, known):
                yield source.span(statement), "pass"
            known |= {n.id for n in ast.walk(statement) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}


def returned_default(node: ast.AST, source: Source) -> Iterator[Change]:
    """A function returns the empty value of its annotation: 0, "", None, zeros; a truth value is negated."""
    if isinstance(node, ast.FunctionDef) and node.returns is not None:
        annotation = ast.unparse(node.returns)
        for statement in _statements(node):
            if isinstance(statement, ast.Return) and statement.value is not None:
                text = _default(annotation, source.segment(statement.value))
                if text and text != source.segment(statement.value):
                    yield source.span(statement.value), text


_COMMUTATIVE = ("min", "max", "minimum", "maximum", "logaddexp", "hypot")


def swapped_arguments(node: ast.AST, source: Source) -> Iterator[Change]:
    """Two positional arguments that follow each other are exchanged, unless the order has no effect, as in `min`."""
    if (
        isinstance(node, ast.Call)
        and not any(isinstance(argument, ast.Starred) for argument in node.args)
        and ast.unparse(node.func).rpartition(".")[2] not in _COMMUTATIVE
    ):
        for left, right in pairwise(node.args):
            (start, end), (second, last) = source.span(left), source.span(right)
            if ast.dump(left) != ast.dump(right):
                yield (start, last), source.text[second:last] + source.text[end:second] + source.text[start:end]


OPERATORS: Mapping[str, Callable[[ast.AST, Source], Iterator[Change]]] = {
    "comparison": comparison,
    "boundary": boundary,
    "plus_minus": plus_minus,
    "times_divide": times_divide,
    "sign": sign,
    "constant": constant,
    "and_or": and_or,
    "negation": negation,
    "dropped_statement": dropped_statement,
    "returned_default": returned_default,
    "swapped_arguments": swapped_arguments,
}


def mutations(file: str, text: str) -> list[Mutation]:
    """All mutations of a file, by position; `file` is its path relative to the checkout."""
    source = Source(text)
    found = []
    for node in _walk(source.tree):
        for name, operator in OPERATORS.items():
            for span, new in operator(node, source):
                number, line = source.line_of(span[0])
                start, end = source.lines_of(span)
                mutant = " ".join((text[start : span[0]] + new + text[span[1] : end]).split())
                found.append(Mutation(file, number, name, span, new, line.strip(), mutant))
    return sorted(found, key=lambda m: (m.span, m.operator))


def _walk(node: ast.AST) -> Iterator[ast.AST]:
    """All nodes that may be mutated."""
    yield node
    for child in ast.iter_child_nodes(node):
        if not _is_exempt(child, node):
            yield from _walk(child)


def _is_exempt(child: ast.AST, parent: ast.AST) -> bool:
    """Whether a node is text, an annotation, or code that only type checkers run."""
    if isinstance(child, ast.JoinedStr | ast.Raise | ast.arg):
        return True
    if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant):
        return True
    if isinstance(child, ast.If) and ast.unparse(child.test).endswith("TYPE_CHECKING"):
        return True
    if isinstance(parent, ast.FunctionDef):
        return child is parent.returns or child in parent.decorator_list
    if isinstance(parent, ast.ClassDef):
        return child in parent.decorator_list or child in parent.bases
    return isinstance(parent, ast.AnnAssign) and child is parent.annotation


def _statements(function: ast.FunctionDef) -> Iterator[ast.stmt]:
    """Statements of a function in their order, without those of functions and classes inside it."""
    pending: list[ast.stmt] = list(function.body)
    while pending:
        statement = pending.pop(0)
        if isinstance(statement, ast.FunctionDef | ast.ClassDef):
            continue
        yield statement
        inner = [
            inside
            for field in ("body", "handlers", "orelse", "finalbody")
            for part in getattr(statement, field, [])
            for inside in (part.body if isinstance(part, ast.ExceptHandler) else [part])
        ]
        pending = inner + pending


def _may_drop(statement: ast.stmt, known: set[str]) -> bool:
    if isinstance(statement, ast.Expr):
        return isinstance(statement.value, ast.Call)
    if isinstance(statement, ast.AugAssign):
        return True
    if not isinstance(statement, ast.Assign):
        return False
    names = [n for target in statement.targets for n in ast.walk(target) if isinstance(n, ast.Name | ast.Attribute)]
    return all(not isinstance(n, ast.Name) or isinstance(n.ctx, ast.Load) or n.id in known for n in names)


def _default(annotation: str, value: str) -> str:
    """New text of a returned value; "" where the annotation has no empty value."""
    if annotation == "bool":
        return f"not ({value})"
    if annotation == "Floats":
        return f"0.0 * ({value})"
    if "None" in annotation.split(" | "):
        return "None"
    return {"float": "0.0", "int": "0", "str": '""'}.get(annotation, "")
