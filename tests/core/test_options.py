"""Options after a name."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.core.options import expand_alternatives, parse_name, split_outside_brackets
from harness.errors import BadInput


@pytest.mark.parametrize(
    ("text", "options"),
    [
        ("blend", {}),
        ("blend[k=8]", {"k": 8}),
        ("blend[k=8, kept=0.8]", {"k": 8, "kept": 0.8}),
        ("blend[loss.robust=false,loss.reach_m=1e-2]", {"loss": {"robust": False, "reach_m": 0.01}}),
        ("blend[index=tree]", {"index": "tree"}),
        ('blend[index="a,b]"]', {"index": "a,b]"}),
        ("blend[weights=[0.6, 0.2, 0.2],k=3]", {"weights": [0.6, 0.2, 0.2], "k": 3}),
        ("blend[gate=none]", {"gate": "none"}),
    ],
)
def test_values_are_toml_s_and_words(text: str, options: dict[str, Any]) -> None:
    assert parse_name(text) == ("blend", options)


@pytest.mark.parametrize(
    "text",
    ["a[", "a]", "a[]", "a[k]", "a[k=]", "a[=3]", "a[k=1,k=2]", "a[k=1,k.b=2]", "a[.k=1]", "a[k=1]b", "[k=1]",
     "a[k=1][j=2]", "a[k='x]", "a[k=1,]"],
)  # fmt: skip
def test_what_is_not_written_so_is_refused(text: str) -> None:
    with pytest.raises(BadInput, match="OPTION=VALUE"):
        parse_name(text)


def test_a_value_cannot_smuggle_in_others() -> None:
    assert parse_name("a[k=1\nj=2]") == ("a", {"k": "1\nj=2"})


def test_alternatives_are_every_combination() -> None:
    assert expand_alternatives("map[k=1|2,on=true|false]+ik") == [
        "map[k=1,on=true]+ik",
        "map[k=1,on=false]+ik",
        "map[k=2,on=true]+ik",
        "map[k=2,on=false]+ik",
    ]
    assert expand_alternatives("map+ik[s=1|2]") == ["map+ik[s=1]", "map+ik[s=2]"]
    assert expand_alternatives("map") == ["map"]
    assert expand_alternatives("map[w=[1,2]|[3,4]]") == ["map[w=[1,2]]", "map[w=[3,4]]"]


def test_lists_of_names_are_cut_outside_brackets() -> None:
    assert split_outside_brackets("ik, map[k=1,j=2]+ik,my:Own", ",") == ["ik", "map[k=1,j=2]+ik", "my:Own"]
    with pytest.raises(BadInput, match="do not match"):
        split_outside_brackets("ik,map[k=1", ",")


@given(
    st.dictionaries(
        st.from_regex(r"[a-z_]{1,8}", fullmatch=True), st.integers(-(2**63), 2**63 - 1) | st.booleans(), min_size=1
    )
)
def test_what_is_written_is_read(options: dict[str, int | bool]) -> None:
    text = "x[" + ",".join(f"{key}={str(value).lower()}" for key, value in options.items()) + "]"
    assert parse_name(text) == ("x", options)
    assert expand_alternatives(text) == [text]
