"""The registry of methods."""

import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from harness.core.working_folder import serve_folder
from harness.errors import BadInput, RenamedKey, UnknownName
from harness.reconstruct import registry
from harness.reconstruct.methods.clean_up import CleanUp
from harness.reconstruct.methods.ik import GAUSSIAN, Ik
from harness.reconstruct.methods.mean_pose import MeanPose


@pytest.mark.parametrize("name", sorted(registry.list_methods()))
def test_every_name_makes_its_method(name: str) -> None:
    method = registry.make_method(name)
    assert method.name == name
    assert registry.summary(name) == method.summary
    assert 10 < len(method.summary) < 110
    assert "\n" not in method.summary
    assert repr(method) == repr(registry.make_method(name))


def test_clean_up_is_added_by_suffix() -> None:
    method = registry.make_method("mean_pose+ik")
    assert isinstance(method, CleanUp)
    assert (method.name, method.needs_examples) == ("mean_pose+ik", True)


def test_presets_differ_in_their_repr() -> None:
    assert repr(Ik()) != repr(GAUSSIAN)
    assert registry.make_method("ik:gaussian") == GAUSSIAN


def test_a_class_is_found_by_its_module() -> None:
    assert registry.make_method("harness.reconstruct.methods.mean_pose:MeanPose") == MeanPose()


@pytest.mark.parametrize(
    ("name", "said"),
    [
        *((name, "mean_pose") for name in ("", "ik:gausian", "ik:", "mean", "ik2+ik", "+ik")),
        *((name, "no module in ") for name in ("../x:Class", "no_such_module:Class", ":Class")),
    ],
)
def test_unknown_names_are_refused_with_the_choices(name: str, said: str) -> None:
    with pytest.raises(UnknownName) as caught:
        registry.make_method(name)
    assert said in str(caught.value)


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
        registry.make_method(name)


@pytest.mark.parametrize(
    ("name", "advice"),
    [
        *((f"{name}[lost_after_s=1.0]", "LOST after 0.5 s") for name in ("ik", "local_pca", "dynamic_map:literal")),
        ("weighted_blend[root_sigma_m=0.2]", "the widths of the prior are fixed"),
        ("kernel_cca:literal[most_steps=8]", "at most 4 steps"),
        ("kernel_cca[longest_gap_s=1.0]", "over at most 0.2 s"),
        ("best_match[velocity_weight=0.0]", "the weights of eq. 2 are fixed"),
    ],
)
def test_a_removed_option_is_refused_with_what_to_write_instead(name: str, advice: str) -> None:
    with pytest.raises(RenamedKey, match=f"was removed. Leave it out: .*{advice}"):
        registry.make_method(name)


def test_a_near_miss_gets_a_suggestion() -> None:
    with pytest.raises(UnknownName, match="Did you mean 'ik:gaussian'"):
        registry.make_method("ik:gausian")


def test_a_module_without_that_class_and_a_class_that_is_no_method() -> None:
    with pytest.raises(UnknownName, match="Did you mean 'MeanPose'"):
        registry.make_method("harness.reconstruct.methods.mean_pose:MeanPoze")
    with pytest.raises(BadInput, match="no summary"):
        registry.make_method("fractions:Fraction")


def test_a_module_that_is_not_found_and_what_a_module_defines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A module of the working folder may have the name of a method."""
    (tmp_path / "ridge.py").write_text(
        "import numpy as np\nfrom dataclasses import dataclass\n"
        "from harness.reconstruct.methods.mean_pose import MeanPose\n"
        "class Other(MeanPose): ...\nclass Ridge(MeanPose): ...\nclass Helper: ...\n"
        "def tuned(): return Ridge()\ndef solve(a, b): ...\n"
    )
    monkeypatch.setattr("sys.meta_path", [*sys.meta_path])
    monkeypatch.delitem(sys.modules, "ridge", raising=False)
    serve_folder(str(tmp_path))
    with pytest.raises(UnknownName, match="called 'ridg'\\. Did you mean 'ridge'") as error:
        registry.make_method("ridg:Ridge")
    assert f"{tmp_path} or the installed packages" in str(error.value)
    (tmp_path / "mine.py").write_text("")
    with pytest.raises(UnknownName, match="Did you mean 'mine:CLASS'"):
        registry.make_method("mine")
    with pytest.raises(UnknownName, match="Did you mean 'Ridge'") as error:
        registry.make_method("ridge:Rigde")
    assert error.value.known == ("Ridge", "Other", "tuned")
    assert registry.make_method("ridge:Ridge").fit is not None
    del sys.modules["ridge"]


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
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, name: str, message: str
) -> None:
    module = f"somebodys_{tmp_path.name}"
    (tmp_path / f"{module}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(BadInput, match=message):
        registry.make_method(f"{module}:{name}")


def test_packages_add_methods_but_never_replace_one(monkeypatch: pytest.MonkeyPatch) -> None:
    def installed(group: str) -> Iterator[EntryPoint]:
        assert group == "harness.methods"
        for name in ("theirs", "ik"):
            yield EntryPoint(name, "harness.reconstruct.methods.mean_pose:MeanPose", group)

    monkeypatch.setattr(registry, "entry_points", installed)
    assert registry.make_method("theirs") == MeanPose()
    assert registry.make_method("ik") == Ik()


def test_options_are_the_fields_of_a_method() -> None:
    method = registry.make_method("ik[loss.robust=false]")
    assert method == replace(Ik(), loss=replace(Ik().loss, robust=False), name="ik[loss.robust=false]")
    assert method.name == "ik[loss.robust=false]"
    assert registry.make_method("ik") == Ik()
    assert repr(registry.make_method("ik[jump_m=inf]")) == repr(replace(Ik(), jump_m=math.inf, name="ik[jump_m=inf]"))


def test_options_of_a_method_and_of_its_clean_up() -> None:
    method = registry.make_method("ik:gaussian[stopping.most_steps=3]+ik[prior_sigma_rad=0.25]")
    assert isinstance(method, CleanUp)
    assert isinstance(method.method, Ik)
    assert method.prior_sigma_rad == 0.25
    assert method.method.stopping.most_steps == 3
    assert method.name == "ik:gaussian[stopping.most_steps=3]+ik"


def test_options_of_a_class_from_outside() -> None:
    name = "harness.reconstruct.methods.ik:Ik[stopping.most_steps=2]"
    method = registry.make_method(name)
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
        registry.make_method(name)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("ik[loss.robust=3]", "expected true or false"),
        ("ik[stopping.most_steps=0.5]", "expected a whole number"),
        ("ik[stopping=3]", "expected a table"),
        ("ik[jump_m=nan]", "finite"),
        ("tests.reconstruct.test_registry:Plain[k=3]", "takes no options"),
    ],
)
def test_values_of_options_are_checked(name: str, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        registry.make_method(name)


class Plain:
    """A method without options."""

    name, summary, needs_examples, fit = "plain", "nothing", False, None


def test_an_installed_package_is_imported_only_when_its_method_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    broken = EntryPoint("theirs", "no_such_package.methods:Theirs", "harness.methods")
    monkeypatch.setattr(registry, "entry_points", lambda group: [broken])
    assert registry.make_method("ik") == Ik()
    with pytest.raises(BadInput, match=r"theirs \(no_such_package.methods:Theirs\) cannot be made"):
        registry.make_method("theirs")


@pytest.mark.parametrize(
    ("name", "inside"),
    [
        ("ik:previous[jump_m=1.0]+ik", True),
        ("harness.reconstruct.methods.ik:Ik", True),
        ("upright:Upright", False),
        ("harness2:Ik+ik", False),
        ("no_such_name", False),
    ],
)
def test_built_in_methods_are_told_by_name(name: str, inside: bool) -> None:
    assert registry.is_built_in(name) is inside


def test_the_same_draws_whatever_the_options() -> None:
    assert registry.without_options("best_match[size=3]+ik[prior_sigma_rad=1]") == "best_match+ik"
