"""Defaults of the methods, against the tables of docs/methods.md and the constants that the papers print."""

import math
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from operator import attrgetter
from pathlib import Path

import pytest

from harness.reconstruct import registry

PAGE = Path(__file__).parents[2] / "docs" / "methods.md"
UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "°": math.pi / 180.0, "rad": 1.0}
PLAIN = {"inf": math.inf, "true": True, "false": False}


def tables() -> Iterator[tuple[str, list[list[str]]]]:
    """Section and rows of each table, the header first."""
    section, rows = "", list[list[str]]()
    for line in [*PAGE.read_text(encoding="utf-8").splitlines(), ""]:
        if line.startswith("|"):
            rows.append([cell.strip() for cell in line.strip("|").split("|")])
            continue
        if rows:
            yield section, rows
            rows = []
        if line.startswith("## "):
            section = line[3:]


def values(cell: str) -> list[float | bool | str]:
    """The values of a cell, such as "3 mm, 0.5°", in SI units; a number without a unit has that of the next one."""
    out, unit = list[float | bool | str](), 1.0
    for part in reversed(cell.split(", ")):
        word = part.strip("`")
        number = re.fullmatch(r"([\d.e+-]+) ?(mm|cm|m|°|rad)?", word)
        if number is None:
            out.append(PLAIN.get(word, word))
        else:
            unit = UNITS[number[2]] if number[2] else unit
            out.append(float(number[1]) * unit)
    return out[::-1]


@cache
def documented() -> dict[tuple[str, str], float | bool | str]:
    """(method, option) -> value."""
    found = dict[tuple[str, str], float | bool | str]()
    for section, (header, _, *rows) in tables():
        if header[0] != "option":
            continue
        base = "ik" if section == "Common parts" else section
        for row in rows:
            names = [name.strip("`") for name in row[0].split(", ")]
            names = [names[0].partition(".")[0] + name if name.startswith(".") else name for name in names]
            for title, cell in zip(header[1:-1], row[1:-1], strict=True):
                method = title.strip("`")
                method = base if method == "default" else base + method if method.startswith(":") else method
                if cell != "–":
                    found |= {(method, name): value for name, value in zip(names, values(cell), strict=True)}
    return found


def leaves(options: object, prefix: str = "") -> Iterator[str]:
    """Names of all options, those inside an option with a dot."""
    for field in fields(options):  # type: ignore[arg-type]  # a dataclass
        value = getattr(options, field.name)
        if is_dataclass(value):
            yield from leaves(value, f"{prefix}{field.name}.")
        else:
            yield prefix + field.name


@pytest.mark.parametrize(("method", "option"), documented())
def test_a_default_is_the_documented_one(method: str, option: str) -> None:
    found = attrgetter(option)(registry.make_method(method))
    assert found == pytest.approx(documented()[method, option])


def test_the_tables_are_read() -> None:
    assert len(documented()) > 90
    assert {method for method, _ in documented()} == {
        *("ik", "local_pca", "dynamic_map", "dynamic_map:window", "dynamic_map:literal"),
        *("kernel_cca", "weighted_blend", "kernel_ridge", "ridge"),
    }
    assert values("0.1 mm, 0.3 m") == [pytest.approx(1e-4), 0.3]
    assert values("0.3, 3 m") == [0.3, 3.0]
    assert values("true, `body`") == [True, "body"]


def test_every_option_of_dynamic_map_is_documented_or_shared() -> None:
    """Options that the tables leave out are those of the parts that all methods share, and of the features."""
    told = {option for method, option in documented() if method in ("dynamic_map", "ik")}
    left = set(leaves(registry.make_method("dynamic_map"))) - told
    assert left == {
        *("name", "summary", "index", "jump_m"),
        *(f"regression.{name}" for name in ("window_weight", "lever_m", "directions", "ridge")),
    }


@pytest.mark.parametrize("name", ["ik", "local_pca", "dynamic_map", "dynamic_map:window", "dynamic_map:literal"])
def test_loss_and_stopping_are_shared(name: str) -> None:
    """Options of the table of common parts hold for every method whose own table or text has no other."""
    method, own = registry.make_method(name), {option for key, option in documented() if key == name}
    for (key, option), value in documented().items():
        exempt = option in own or (name == "dynamic_map:literal" and option.startswith("loss."))
        if key == "ik" and option.partition(".")[0] in ("loss", "stopping") and not exempt:
            assert attrgetter(option)(method) == pytest.approx(value), option


GATES_M = {
    **dict.fromkeys(("ik", "local_pca", "dynamic_map:window", "weighted_blend", "kernel_cca"), 0.15),
    "dynamic_map": 0.1,
    **dict.fromkeys(("ik:gaussian", "dynamic_map:literal", "local_pca:chai2005"), math.inf),
    **dict.fromkeys(("kernel_cca:literal", "weighted_blend:literal"), math.inf),
}
"""Distance of the outlier gate, by the second table of the page [m]."""


@pytest.mark.parametrize("name", GATES_M)
def test_the_outlier_gate_is_as_wide_as_documented(name: str) -> None:
    assert attrgetter("jump_m")(registry.make_method(name)) == GATES_M[name]


PRESETS: dict[str, dict[str, float | bool | str]] = {
    # docs/papers.md B3 to B5: k, the weights of eq. 2, alpha and beta of eq. 6 are printed
    "kernel_cca:literal": {
        **{"neighbours": 8, "index": "kd_tree", "outputs": "quaternions", "alpha": 0.3, "beta": 0.4},
        **{"weights.position": 0.6, "weights.velocity": 0.2, "weights.orientation": 0.2},
        **{"bases": 6, "kappa": 0.01, "regularise_projection": False, "width": 1.0},
    },
    "weighted_blend:literal": {
        **{"neighbours": 8, "index": "kd_tree", "outputs": "quaternions", "alpha": 0.3, "beta": 0.4, "power": 1.0},
        **{"weights.position": 0.6, "weights.velocity": 0.2, "weights.orientation": 0.2},
    },
    # docs/papers.md C2: 7 directions, alpha 0.8 and beta 0.2 per rad^2; squared residuals and nothing of ours
    "local_pca:chai2005": {
        **{"neighbours": 100, "components": 7, "prior_weight": 0.8, "smooth_weight": 0.2, "smooth_sigma_rad": 1.0},
        **{"widening": 0.0, "ik_prior_weight": 0.0, "restart": False},
        **{"loss.robust": False, "loss.quality": False, "loss.suspect_weight": 1.0, "control_weight": 1.0},
    },
    "ik:previous": {"towards_mean": 0.0, "spread": False, "prior_sigma_rad": math.radians(30.0)},
    "ik:mean": {"towards_mean": 1.0, "spread": False, "prior_sigma_rad": math.radians(30.0)},
    "ik:gaussian": {"loss.robust": False, "towards_mean": 0.1, "spread": True},
    "dynamic_map:literal": {"loss.robust": True, "loss.quality": False, "loss.suspect_weight": 1.0},
    "dynamic_map": {
        **{"regression.window_weight": 0.3, "regression.lever_m": 0.3, "regression.directions": 40},
        **{"regression.ridge": 1e-5},
    },
}


@pytest.mark.parametrize("name", PRESETS)
def test_a_variant_is_what_its_text_says(name: str) -> None:
    method = registry.make_method(name)
    assert {option: attrgetter(option)(method) for option in PRESETS[name]} == pytest.approx(PRESETS[name])
