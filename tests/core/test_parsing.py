"""JSON and TOML are parsed, or refused in one line that names the fault."""

import time

import pytest

from harness.core.parsing import MAX_DEPTH, parse_json, parse_toml


def test_ordinary_content_is_parsed() -> None:
    assert parse_json('{"a": [1, -2.5, null, "\\u00e9"], "b": 9223372036854775807}') == {
        "a": [1, -2.5, None, "é"],
        "b": 2**63 - 1,
    }
    assert parse_toml("a.b = [1, 'x']\n[c]\nd = 9223372036854775807") == {"a": {"b": [1, "x"]}, "c": {"d": 2**63 - 1}}
    assert parse_json("[" * MAX_DEPTH + "]" * MAX_DEPTH)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('{"a": ' + "9" * 5000 + "}", "the integer 999999999999... of 5000 characters does not fit into 64 bits"),
        ('{"a": 9223372036854775808}', "does not fit into 64 bits"),
        ('{"a": "\\ud800"}', r"the single surrogate \ud800"),
        ("[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1), f"nested more than {MAX_DEPTH} deep"),
        ("[" * 100_000, f"nested more than {MAX_DEPTH} deep"),
        ('{"a": ', "line 1 column 7"),
    ],
)
def test_bad_json_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=r".") as refused:
        parse_json(text)
    assert reason in str(refused.value)
    assert str(refused.value).isprintable()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a = " + "9" * 5000, "a value that cannot be read"),
        ("a = " + "9" * 400, "a is an integer that does not fit into 64 bits"),
        ("[a.b]\nc = [1, {d = 0x" + "f" * 300 + "}]", "a.b.c.d is an integer that does not fit into 64 bits"),
        ("[a]\nb = 1979-05-27", "a.b is a date or a time"),
        ("a = 07:32:00", "a is a date or a time"),
        ("a = " + "[" * 60 + "]" * 60, f"nested more than {MAX_DEPTH} deep"),
        ("a = " + "[" * 5000, f"nested more than {MAX_DEPTH} deep"),
        ("b = 1\n" + ".".join("a" * 9000) + " = 1", "more than 100 dots between two commas (at line 2)"),
        ("a = ", "at end of document"),
    ],
)
def test_bad_toml_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=r".") as refused:
        parse_toml(text)
    assert reason in str(refused.value)
    assert str(refused.value).isprintable()


def test_a_key_of_many_dots_takes_no_time() -> None:
    start_s = time.process_time()
    with pytest.raises(ValueError, match="dots"):
        parse_toml(".".join("a" * 200_000) + " = 1")  # `tomllib` takes minutes
    assert time.process_time() - start_s < 2.0


def test_long_lists_of_decimal_numbers_are_no_keys() -> None:
    assert len(parse_toml("a = [" + ", ".join(["0.5"] * 1000) + "]")["a"]) == 1000
