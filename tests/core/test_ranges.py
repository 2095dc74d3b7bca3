"""Names that no folder can have, or that break a line, are refused in one line of bounded length."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, is_dataclass, make_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import pytest

from harness.cli import main
from harness.compare import write_baseline
from harness.core.fields import build, replace_fields
from harness.core.ranges import Label, Range, check_fields, check_words, constraints_of
from harness.errors import BadInput, HarnessError
from harness.experiment.scenarios import Scenario, Sweep, load_scenario, load_sweep
from harness.reconstruct import list_methods, make_method
from harness.simulate import Noise
from harness.study.placement.config import PlacementStudy

LONGEST_LINE = 1100
BAD = {"empty": "", "long": "x" * 1001, "null": "a\\u0000b", "newline": "a\\nb", "bell": "a\\u0007b"}
"""Values in TOML's escapes."""
NO_FILE = BAD | {"parent": "..", "path": "../other", "backslash": "a\\\\b"}
SCENARIO = """
name = "{name}"
methods = ["{method}"]
[motion]
source = "builtin"
behaviours = ["{behaviour}"]
test = ["{test}"]
[stations]
"{station}" = {{ bone = "head" }}
[vary]
"{vary}" = ["clean"]
"""
GOOD = {
    "name": "mine",
    "method": "ik",
    "behaviour": "walking",
    "test": "walking_p1_01",
    "station": "head",
    "vary": "noise",
}


def one_line(text: str) -> bool:
    return text.isprintable() and 0 < len(text) < LONGEST_LINE


def test_good_names_are_read(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO.format(**GOOD))
    assert load_scenario(path).name == "mine"


@pytest.mark.parametrize("bad", NO_FILE)
@pytest.mark.parametrize("key", GOOD)
def test_a_bad_name_in_a_scenario_is_refused(tmp_path: Path, key: str, bad: str) -> None:
    if bad not in BAD and key != "name":
        return  # only folders get names that must be no path
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO.format(**{**GOOD, key: NO_FILE[bad]}))
    with pytest.raises(HarnessError) as caught:
        load_scenario(path)
    assert one_line(str(caught.value).replace(str(tmp_path), ""))


@pytest.mark.parametrize("bad", NO_FILE)
def test_a_bad_name_of_a_sweep_is_refused(tmp_path: Path, bad: str) -> None:
    path = tmp_path / "sweep.toml"
    path.write_text(f'name = "{NO_FILE[bad]}"\nscenarios = ["demo"]\n')
    with pytest.raises(HarnessError) as caught:
        load_sweep(path)
    assert one_line(str(caught.value).replace(str(tmp_path), ""))


@pytest.mark.parametrize("name", ["", "x" * 300, "a\0b", "a\nb", "..", "../x"])
def test_a_bad_name_of_a_baseline_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(BadInput) as caught:
        write_baseline(tmp_path, name, tmp_path)
    assert one_line(str(caught.value))


WORDS = ("", "x" * 300, "a\0b", "a\nb", "x" * 300 + "/run")
COMMANDS = (
    ["run", "demo", "--out", "WORD"],
    ["run", "WORD"],
    ["run", "demo", "--methods", "WORD", "--out", "out"],
    ["sweep", "WORD"],
    ["placement", "WORD"],
    ["baseline", "save", "WORD", "run"],
    ["baseline", "save", "main", "WORD"],
    ["compare", "WORD", "run"],
    ["report", "WORD"],
    ["status", "WORD"],
    ["check", "WORD"],
    ["inspect", "WORD"],
)


@pytest.mark.parametrize(
    ("command", "word"), [*((COMMANDS[0], word) for word in WORDS), *((command, WORDS[3]) for command in COMMANDS[1:])]
)
def test_a_bad_word_of_the_command_line_is_refused(
    command: list[str], word: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([word if part == "WORD" else part for part in command]) == 2
    shown = capsys.readouterr()
    assert shown.out == "refused\n"
    assert one_line(shown.err.removesuffix("\n"))
    assert not list(tmp_path.iterdir())


def test_ordinary_words_are_accepted() -> None:
    check_words(["13_17", Path("../results") / ("x" * 255), None, 5, ("ä ö", Path("/a/b"))])
    assert Label(of_file=True).accepts("builtin walking 2.5")
    assert not Label().accepts(" head")


METHODS = {type(make_method(name)) for name in (*list_methods(), "mean_pose+ik")}
ENDLESS = {"jump_m", "to_s"}
"""Fields that may be as large as you like; `inf` switches the outlier gate off, or lasts to the end."""
NOT_CHOSEN = {"schema"}
CHECKED_TOGETHER = {"Emitter"}
"""Records of the protocol, which `simulate.physics.emitters` checks where a scenario names them."""


def types_in(hint: Any) -> Iterator[type]:
    """The classes that an annotation is made of."""
    parts = get_args(hint)[:1] if get_origin(hint) is Annotated else get_args(hint)
    if not parts and isinstance(hint, type):
        yield hint
    for part in parts:
        yield from types_in(part)


def records(kinds: Iterator[type], found: dict[type, None]) -> dict[type, None]:
    """The dataclasses that files and options fill in, the nested ones too."""
    for kind in kinds:
        if is_dataclass(kind) and kind not in found:
            found[kind] = None
            hints = get_type_hints(kind, include_extras=True)
            records((inner for f in fields(kind) if f.init for inner in types_in(hints[f.name])), found)
    return found


RECORDS = list(records(iter([Scenario, Sweep, PlacementStudy, Noise, *sorted(METHODS, key=str)]), {}))
NUMBERS = [
    (kind, f.name, hint)
    for kind in RECORDS
    if kind.__name__ not in CHECKED_TOGETHER
    for f in fields(kind)
    if f.init and f.name not in NOT_CHOSEN
    for hint in [get_type_hints(kind, include_extras=True)[f.name]]
    if {int, float} & set(types_in(hint))
]


def test_there_are_many() -> None:
    assert len(NUMBERS) > 120
    assert {kind.__name__ for kind, _, _ in NUMBERS} >= {
        "Station",
        "Echo",
        "TrackerConfig",
        "LocalPca",
        "Loss",
        "Fault",
    }


@pytest.mark.parametrize(("kind", "name", "hint"), NUMBERS, ids=lambda part: getattr(part, "__name__", str(part)[:20]))
def test_a_number_without_meaning_is_refused(kind: type, name: str, hint: Any) -> None:
    entry, enclose = ranged_entry(hint)
    assert constraints_of(entry), f"{kind.__name__}.{name} declares no range"
    (allowed,) = constraints_of(entry)
    whole, shape = types_in(entry), without_none(get_args(entry)[0])
    number, count = (
        next(t for t in whole if t in (int, float)),
        len(get_args(shape)) if get_origin(shape) is tuple else 0,
    )
    for bad in (-1e9, 1e9, math.nan, -math.inf):
        if bad == 1e9 and name in ENDLESS:
            continue
        value = number(bad) if math.isfinite(bad) else bad
        if number is int and name in ("seed", "seeds") and value > 0:
            value = 2**63
        given = [value] * (2 if Ellipsis in get_args(shape) else count) if get_origin(shape) is tuple else value
        with pytest.raises((TypeError, ValueError, HarnessError)) as caught:
            replace_fields(holder(name, hint), {name: enclose(given)}, "here", infinite=True)
        assert f"here.{name}" in str(caught.value)
        if math.isfinite(bad):
            assert str(allowed) in str(caught.value)


def ranged_entry(hint: Any) -> tuple[Any, Callable[[Any], Any]]:
    """The annotation that declares the range, and what puts its value into the field: an entry of a list or table."""
    if not constraints_of(hint) and get_origin(hint) is dict:
        return get_args(hint)[1], lambda value: {"entry": value}
    if not constraints_of(hint) and get_origin(hint) is tuple and Ellipsis in get_args(hint):
        return get_args(hint)[0], lambda value: [value]
    return hint, lambda value: value


def without_none(hint: Any) -> Any:
    """A tuple's annotation, also where None may stand for the tuple."""
    return next((part for part in get_args(hint) if get_origin(part) is tuple), hint)


def holder(name: str, hint: Any) -> Any:
    """A record with one field of the tested annotation: most records have fields that must be given."""
    return make_dataclass("Holder", [(name, hint, field(default=None))], frozen=True)()


@dataclass(frozen=True)
class Sample:
    share: Annotated[float, Range(0.0, 1.0)] = 0.5
    size_m: Annotated[tuple[float, float], Range(0.0, 10.0, ascending=True)] = (1.0, 2.0)
    limit_m: Annotated[float, Range(0.0, math.inf)] = 1.0
    slot_s: Annotated[float | None, Range(0.0, 1.0)] = None

    def __post_init__(self) -> None:
        check_fields(self)


def test_the_message_has_the_place_the_range_and_the_value() -> None:
    with pytest.raises(ValueError, match=r"^sample\.share = 1\.5 must be a number from 0 to 1$"):
        build(Sample, {"share": 1.5}, "sample")
    with pytest.raises(ValueError, match="ascending numbers from 0 to 10"):
        build(Sample, {"size_m": [2.0, 1.0]}, "sample")
    with pytest.raises(BadInput, match=r"^Sample\.share = nan\. Give a number from 0 to 1\.$"):
        Sample(share=math.nan)


def test_bounds_and_no_value_are_allowed() -> None:
    made = build(Sample, {"share": 1, "size_m": [0.0, 10.0], "slot_s": "none"}, "sample")
    assert (made.share, made.slot_s) == (1.0, None)
    assert replace_fields(made, {"limit_m": math.inf}, "sample", infinite=True).limit_m == math.inf
    with pytest.raises(TypeError, match="finite"):
        replace_fields(made, {"share": math.inf}, "sample", infinite=True)


def test_a_record_that_is_made_in_python_is_checked_too() -> None:
    scenario_types = [
        kind for kind in RECORDS if kind.__module__.startswith(("harness.experiment.scenarios.scenario", "harness.sim"))
    ]
    assert len(scenario_types) > 15
    for kind in scenario_types:
        if any(kind is record for record, _, _ in NUMBERS):
            assert hasattr(kind, "__post_init__"), kind
    assert replace(Sample(), share=0.0).share == 0.0
