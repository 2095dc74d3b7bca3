"""The registry of methods."""

import math
from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from harness.errors import BadInput, RenamedKey, UnknownName
from harness.reconstruct import registry
from harness.reconstruct.methods.clean_up import CleanUp
from harness.reconstruct.methods.ik import GAUSSIAN, Ik
from harness.reconstruct.methods.mean_pose import MeanPose


@pytest.mark.parametrize("name", sorted(registry.methods()))
def test_every_name_makes_its_method(name: str) -> None:
    method = registry.resolve(name)
    assert method.name == name
    assert registry.summary(name) == method.summary
    assert 10 < len(method.summary) < 110
    assert "\n" not in method.summary
    assert repr(method) == repr(registry.resolve(name))


def test_clean_up_is_added_by_suffix() -> None:
    method = registry.resolve("mean_pose+ik")
    assert isinstance(method, CleanUp)
    assert (method.name, method.needs_examples) == ("mean_pose+ik", True)


def test_presets_differ_in_their_repr() -> None:
    assert repr(Ik()) != repr(GAUSSIAN)
    assert registry.resolve("ik:gaussian") == GAUSSIAN


def test_a_class_is_found_by_its_module() -> None:
    assert registry.resolve("harness.reconstruct.methods.mean_pose:MeanPose") == MeanPose()


@pytest.mark.parametrize(
    "name", ["", "ik:gausian", "ik:", "../x:Class", "mean", "no_such_module:Class", "ik2+ik", ":Class", "+ik"]
)
def test_unknown_names_are_refused_with_the_choices(name: str) -> None:
    with pytest.raises(UnknownName) as caught:
        registry.resolve(name)
    assert "mean_pose" in str(caught.value)


@pytest.mark.parametrize(
    ("name", "new"),
    [
        ("dynamic_map[terms.lever_m=0.2]", "regression"),
        ("dynamic_map[like=window]", "search"),
        ("dynamic_map:literal[kept=0.9]", "variance_kept"),
        ("kernel_cca[held=false]", "regularise_projection"),
    ],
)
def test_an_old_option_is_refused_with_its_new_name(name: str, new: str) -> None:
    with pytest.raises(RenamedKey, match=f"is now called {new!r}"):
        registry.resolve(name)


def test_a_near_miss_gets_a_suggestion() -> None:
    with pytest.raises(UnknownName, match="Did you mean 'ik:gaussian'"):
        registry.resolve("ik:gausian")


def test_a_module_without_that_class_and_a_class_that_is_no_method() -> None:
    with pytest.raises(UnknownName, match="Did you mean 'MeanPose'"):
        registry.resolve("harness.reconstruct.methods.mean_pose:MeanPoze")
    with pytest.raises(BadInput, match="no summary"):
        registry.resolve("fractions:Fraction")


@pytest.mark.parametrize(
    ("text", "name", "message"),
    [
        ("def broken(:", "Any", "SyntaxError"),
        ("import no_such_package", "Any", "no_such_package"),
        ("raise SystemExit(5)", "Any", "SystemExit"),
        ("class Needy:\n    def __init__(self, what): ...", "Needy", "what"),
        ("value = 3", "value", "not callable"),
    ],
)
def test_a_module_or_class_that_cannot_be_used(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    text: str,
    name: str,
    message: str,
) -> None:
    module = f"somebodys_{tmp_path.name}"
    (tmp_path / f"{module}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(BadInput, match=message):
        registry.resolve(f"{module}:{name}")


def test_packages_add_methods_but_never_replace_one(monkeypatch: pytest.MonkeyPatch) -> None:
    def installed(group: str) -> Iterator[EntryPoint]:
        assert group == "harness.methods"
        for name in ("theirs", "ik"):
            yield EntryPoint(name, "harness.reconstruct.methods.mean_pose:MeanPose", group)

    monkeypatch.setattr(registry, "entry_points", installed)
    assert registry.resolve("theirs") == MeanPose()
    assert registry.resolve("ik") == Ik()


def test_the_source_hash_follows_a_method_into_its_own_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The hash covers a file and the modules in its folder that it imports, recursively; no other files."""
    monkeypatch.syspath_prepend(tmp_path)
    for name, text in {
        "split_method": (
            "import split_options\nfrom harness.reconstruct.methods.ik import Ik\n\n\nclass Mine(Ik): ...\n"
        ),
        "split_options": "from split_numbers import *\n",
        "split_numbers": "SIGMA = 1.0\n",
        "split_stranger": "",
    }.items():
        (tmp_path / f"{name}.py").write_text(text)
    mine = registry.resolve("split_method:Mine")
    before = registry.source_hash(mine)
    (tmp_path / "split_stranger.py").write_text("OTHER = 2.0\n")
    assert registry.source_hash(mine) == before
    (tmp_path / "split_numbers.py").write_text("SIGMA = 2.0\n")
    assert registry.source_hash(mine) != before


def test_the_source_hash_tells_methods_and_what_they_wrap_apart() -> None:
    hashes = {
        registry.source_hash(registry.resolve(n)) for n in ("ik", "mean_pose", "best_match", "mean_pose+ik", "ik+ik")
    }
    assert len(hashes) == 5
    assert registry.source_hash(Ik()) == registry.source_hash(GAUSSIAN)


def test_options_are_the_fields_of_a_method() -> None:
    method = registry.resolve("ik[loss.robust=false]")
    assert method == replace(Ik(), loss=replace(Ik().loss, robust=False), name="ik[loss.robust=false]")
    assert method.name == "ik[loss.robust=false]"
    assert registry.resolve("ik") == Ik()
    assert repr(registry.resolve("ik[jump_m=inf]")) == repr(replace(Ik(), jump_m=math.inf, name="ik[jump_m=inf]"))


def test_options_of_a_method_and_of_its_clean_up() -> None:
    method = registry.resolve("ik:gaussian[stopping.most_steps=3]+ik[prior_sigma_rad=0.25]")
    assert isinstance(method, CleanUp)
    assert isinstance(method.method, Ik)
    assert method.prior_sigma_rad == 0.25
    assert method.method.stopping.most_steps == 3
    assert method.name == "ik:gaussian[stopping.most_steps=3]+ik"


def test_options_of_a_class_from_outside() -> None:
    name = "harness.reconstruct.methods.ik:Ik[stopping.most_steps=2]"
    method = registry.resolve(name)
    assert isinstance(method, Ik)
    assert (method.stopping.most_steps, method.name) == (2, name)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("ik[lss.robust=true]", "Did you mean 'loss'"),
        ("ik[loss.robus=true]", "Did you mean 'robust'"),
        ("ik[name=other]", "no option of ik called 'name'"),
        ("mean_pose+ik[sigma=3]", r"no option of mean_pose\+ik called 'sigma'"),
        ("ikk[loss.robust=true]", "Did you mean 'ik'"),
        ("ik+ok[x=1]", "no method called"),
    ],
)
def test_wrong_options_get_a_suggestion(name: str, message: str) -> None:
    with pytest.raises(UnknownName, match=message):
        registry.resolve(name)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("ik[loss.robust=3]", "expected bool"),
        ("ik[stopping.most_steps=0.5]", "expected int"),
        ("ik[stopping=3]", "expected a table"),
        ("ik[jump_m=nan]", "finite"),
        ("tests.reconstruct.test_registry:Plain[k=3]", "takes no options"),
    ],
)
def test_values_of_options_are_checked(name: str, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        registry.resolve(name)


class Plain:
    """A method without options."""

    name, summary, needs_examples, fit = "plain", "nothing", False, None


def test_the_same_draws_whatever_the_options() -> None:
    assert registry.without_options("best_match[size=3]+ik[prior_sigma_rad=1]") == "best_match+ik"
