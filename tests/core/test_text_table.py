"""Tables as text: alignment, wrapping and the width of lines."""

from harness.core.text_table import Table


def test_text_is_aligned_left_and_numbers_right() -> None:
    assert Table(["method", "error"], [["ik", "1.25"], ["local_pca", "12.00"]]).lines() == [
        "method     error",
        "ik          1.25",
        "local_pca  12.00",
    ]


def test_lines_have_no_trailing_blanks() -> None:
    lines = Table(["a", "note"], [["1", "long note"], ["2", ""]], text_columns=2).lines()
    assert lines == ["a  note", "1  long note", "2"]


def test_wide_cells_wrap_to_the_width_and_keep_every_word() -> None:
    words = [f"word{n}" for n in range(30)]
    table = Table(["claim", "verdict"], [[" ".join(words), "reproduced"]], text_columns=2)
    head, row = table.wrapped_rows(60, shrinkable=[0])
    assert max(map(len, [*head, *row])) <= 60
    assert [word for line in row for word in line.split() if word.startswith("word")] == words
    assert row[0].endswith("reproduced")


def test_a_column_never_becomes_narrower_than_a_word_needs() -> None:
    (_, row) = Table(["claim", "x"], [["several words in one cell", "0" * 50]]).wrapped_rows(20, shrinkable=[0])
    assert row[0].startswith("several")
    assert row[0].endswith("0" * 50)
