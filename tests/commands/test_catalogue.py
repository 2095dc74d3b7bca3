"""What `harness list` says."""

from importlib.metadata import EntryPoint

import numpy as np
import pytest

from harness.body import NAMED_PLACES, build_body
from harness.commands.catalogue import build_catalogue
from harness.reconstruct import MeanPose, list_methods
from tests.command import Command


class Theirs(MeanPose):
    """A method that says where it comes from."""

    source = "Somebody 2031"


class Undeclared(MeanPose):
    """A method that does not say what it learnt from."""

    training_data = "unknown"


def test_every_method_is_named_with_its_needs_and_where_it_comes_from() -> None:
    methods = build_catalogue()["methods"]
    assert set(methods) == set(list_methods())
    assert "needs examples, takes any inputs; Liu et al. 2011" in methods["dynamic_map"]
    assert "needs no examples" in methods["ik:previous"]
    assert all(line.count("needs ") >= 1 for line in methods.values())


def test_a_method_of_a_package_is_listed_with_its_own_source(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = EntryPoint("theirs", "tests.commands.test_catalogue:Theirs", "harness.methods")
    monkeypatch.setattr("harness.reconstruct.registry.entry_points", lambda group: [entry])
    assert build_catalogue()["methods"]["theirs"].endswith("takes any inputs; Somebody 2031")
    entry = EntryPoint("theirs", "tests.commands.test_catalogue:Undeclared", "harness.methods")
    assert build_catalogue()["methods"]["theirs"].endswith("takes any inputs; training data unknown")


def test_hinges_are_listed_in_the_order_of_the_model() -> None:
    listed, body = build_catalogue()["hinges in the order of qpos"], build_body()
    addresses = {body.model.joint(name).qposadr[0]: name for name in listed}
    assert [addresses[place] for place in range(7, 55)] == list(listed)
    assert list(listed) != list(body.skeleton.dof_names)
    assert [text.partition(";")[0] for text in listed.values()] == [f"qpos[{place}]" for place in range(7, 55)]
    for name, text in listed.items():
        low, high = np.rad2deg(body.model.joint(name).range)
        axis = ", ".join(f"{x:.2f}" for x in body.model.joint(name).axis)
        assert text.endswith(f"; axis ({axis}) of its bone; {low:.0f} to {high:.0f} deg")


def test_a_scenario_says_what_it_varies() -> None:
    assert "varies noise" in build_catalogue()["scenarios"]["boxing"]
    assert "walk" in build_catalogue()["placement studies"]["walking"]
    assert "noise default" in build_catalogue()["scenarios"]["demo"]


def test_scenarios_that_only_choose_constants_come_with_all(command: Command) -> None:
    users = command("list", "scenarios", "--json").content["scenarios"]
    every = command("list", "scenarios", "--all", "--json").content["scenarios"]
    hidden = every.keys() - users.keys()
    assert {"demo", "boxing", "lab"} <= users.keys() < every.keys()
    assert {name.partition("_")[0] for name in hidden} == {"tune", "validate"}


def test_one_kind_is_listed_alone(command: Command) -> None:
    lines = command("list", "places").lines
    assert lines[0] == "places:"
    assert lines[1:-1] == [f"  {place.name:<15}  {place.text}; bone {place.bone}" for place in NAMED_PLACES.values()]
    assert next(iter(command("list", "motion", "--json").content)) == "motion of the built-in performer"
    assert "Did you mean 'places'?" in command("list", "place", code=2).err
