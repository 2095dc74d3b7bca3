"""Every number that a scenario, a study or an option may set has a declared range, and other numbers are refused."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, is_dataclass, make_dataclass, replace
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import pytest

from harness.core.fields import build, replace_fields
from harness.core.ranges import Range, check_fields, constraints_of
from harness.errors import BadInput, HarnessError
from harness.experiment.scenario import Scenario
from harness.experiment.sweep_config import Sweep
from harness.reconstruct import registry
from harness.simulate.noise import Noise
from harness.study.placement.config import PlacementStudy

METHODS = {type(registry.resolve(name)) for name in (*registry.methods(), "mean_pose+ik")}
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
        kind for kind in RECORDS if kind.__module__.startswith(("harness.experiment.scenario", "harness.sim"))
    ]
    assert len(scenario_types) > 15
    for kind in scenario_types:
        if any(kind is record for record, _, _ in NUMBERS):
            assert hasattr(kind, "__post_init__"), kind
    assert replace(Sample(), share=0.0).share == 0.0
