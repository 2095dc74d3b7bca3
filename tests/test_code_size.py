"""The counter of code lines, by an example."""

from tests.code_size import code_lines


def test_only_code_counts() -> None:
    source = '"""Module."""\n\nX = 1  # one\n"""Attribute\nof two lines."""\n\n\n'
    source += 'def f(\n    a,\n):\n    """Doc."""\n    return """a\nb"""\n'
    assert code_lines(source) == 6
