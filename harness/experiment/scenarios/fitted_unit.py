"""The errors, clock and tracker of a measured unit in a scenario: the key `fitted`."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from harness.core.fields import build, replace_fields
from harness.core.toml_file import EARLIER_SCHEMA
from harness.errors import BadFile, BadInput, HarnessError
from harness.measure import CUT_ADVICE, UNIT_FILE, UnitFile, read_unit_file
from harness.simulate import TrackerConfig, noise_preset

FITTED_PRESET = "default"
"""The preset whose components a unit file replaces, every one of them."""


def read_fitted_unit(path: Path) -> UnitFile:
    """Read a unit file and check its values as those of a scenario; BadFile."""
    unit = read_unit_file(path)
    preset = noise_preset(FITTED_PRESET)
    if unit.schema == EARLIER_SCHEMA:
        for name, component in asdict(preset).items():
            for field in component or {}:
                if unit.components.get(name, {}).get(field) is None:
                    raise BadFile(
                        path, f"damaged: no components.{name}.{field}", f"the whole of {UNIT_FILE}", CUT_ADVICE
                    )
    try:
        replace_fields(preset, unit.components, "components")
        build(TrackerConfig, unit.tracker, "tracker")
    except (TypeError, ValueError, HarnessError) as error:
        advice = "Each key is one of a scenario's [components] or [tracker]; the message names the wrong one."
        raise BadFile(path, str(error).rstrip("."), UNIT_FILE, advice) from error
    return unit


def merge_fitted_unit(content: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The content of a scenario's file with the values of the unit that its key `fitted` names, relative to `folder`.

    The scenario's own [components] and [tracker] take precedence. BadFile for a file outside the folder and for a file
    that is no unit file. BadInput for another noise preset, which would have no effect, and for [physics].
    """
    name = content["fitted"]
    if not isinstance(name, str) or not name:
        raise BadInput(f"fitted = {name!r}.", "Name a unit file in the scenario's folder.")
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise BadFile(path, "a file outside the scenario's folder", "a path inside it", "Copy the file there.")
    if content.get("noise", FITTED_PRESET) != FITTED_PRESET or "noise" in content.get("vary", {}):
        raise BadInput("fitted beside a noise preset: the unit replaces it.", "Remove the key `noise`, or `fitted`.")
    if "physics" in content:
        found = "fitted beside [physics]: errors of the unit and their causes would count twice."
        raise BadInput(found, "Remove one of them.")
    unit = read_fitted_unit(path)
    return {
        "profile": unit.name,
        **content,
        "components": _merge(unit.components, content.get("components", {})),
        "tracker": {**unit.tracker, **content.get("tracker", {})},
    }


def _merge(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """A nested table with another one over it; a value that is no table replaces what was there."""
    merged = dict(base)
    for key, value in changes.items():
        before = merged.get(key)
        merged[key] = _merge(before, value) if isinstance(before, Mapping) and isinstance(value, Mapping) else value
    return merged
