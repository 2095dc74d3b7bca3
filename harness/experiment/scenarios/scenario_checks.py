"""The rules of a scenario that types cannot express."""

from itertools import pairwise
from pathlib import Path

from harness.core.split import ClipPart
from harness.errors import BadFile, UnknownName
from harness.experiment.scenarios.scenario import SCHEMA, Scenario
from harness.results import varied_text


def check_scenario(path: Path, scenario: Scenario) -> None:
    """Check the rules that types cannot express; BadFile names `path`."""

    def refuse(found: str, expected: str, advice: str) -> None:
        raise BadFile(path, found, expected, advice)

    if scenario.schema != SCHEMA:
        refuse(f"schema {scenario.schema}", f"schema {SCHEMA}", "This version of the harness reads no other schema.")
    if not scenario.motion.test:
        refuse("no test clips", "names in motion.test", "`harness mocap list` names what a library holds.")
    if not scenario.stations:
        refuse("no stations", "a table [stations] with at least one", "For example: head = { bone = 'head' }.")
    if not scenario.methods:
        refuse("no methods", "names in methods", "`harness list` names them.")
    if not scenario.inputs:
        refuse("no inputs", "names in inputs", "`harness list` names them.")
    if not scenario.motion.behaviours_fit:
        refuse(
            f"{len(scenario.motion.behaviours)} behaviours for {len(scenario.motion.test)} test clips",
            "one word for all, or one for each",
            "Give motion.behaviours one word.",
        )
    for values, variant in scenario.variants() if scenario.vary else ():
        try:
            check_scenario(path, variant)
        except BadFile as error:
            refuse(f"{error.found} with {varied_text(values)}", error.expected, error.advice)
    for what, repeated in (
        ("motion.test", scenario.motion.test),
        ("methods", scenario.methods),
        ("inputs", scenario.inputs),
        ("worn", scenario.worn),
    ):
        if len(set(repeated)) < len(repeated):
            refuse(f"{what} names something twice", "each name once", "Remove the second.")
    parts = sorted(map(ClipPart.parse, scenario.motion.test), key=lambda part: (part.clip, part.start))
    for one, other in pairwise(parts):
        if one.clip == other.clip and other.start < one.end:
            refuse(f"motion.test has {one} and {other}, which overlap", "parts without common frames", "Shorten one.")
    for name in scenario.worn:
        if name not in scenario.stations:
            refuse(f"worn names {name!r}", "names of [stations]", f"They are: {', '.join(scenario.stations)}.")
    _check_settings_of_stations(scenario)


def _check_settings_of_stations(scenario: Scenario) -> None:
    """UnknownName for prediction or enhancement of a station that is not there."""
    fusion = scenario.physics.fusion if scenario.physics else None
    for key in ("prediction_ms", "enhancement"):
        for name in getattr(fusion, key, ()):
            if name not in scenario.stations:
                raise UnknownName(f"station in physics.fusion.{key}", name, scenario.stations)


def check_expected_orders(path: Path, scenario: Scenario) -> None:
    """Check that expected orders name the scenario's methods or inputs; BadFile.

    The command line skips the check where it replaces the methods.
    """
    for order in scenario.expected_order:
        where, what, known = f"the order of {order.source!r}", "methods", scenario.methods
        if order.inputs:
            what, known = "inputs", scenario.inputs
        strange = [name for name in order.names if name not in known]
        if order.inputs and order.method not in scenario.methods:
            strange, what, known = [order.method], "methods", scenario.methods
        faults = {
            "has no source": not order.source,
            "names neither or both of methods and inputs": bool(order.methods) == bool(order.inputs),
            "names a method whose inputs it does not compare": bool(order.method) > bool(order.inputs),
            "names fewer than two": len(order.names) < 2,
            "names something twice": len(set(order.names)) < len(order.names),
            f"names {', '.join(map(repr, strange))}, none of the scenario's {what}": bool(strange),
            "gives a reason for a step that it does not have": not set(order.why_not) <= set(order.steps),
        }
        for fault in (text for text, found in faults.items() if found):
            advice = f"Known {what}: {', '.join(known)}. Reasons belong to {', '.join(map(repr, order.steps))}."
            raise BadFile(path, f"{where} {fault}", "two or more methods, or inputs and their method", advice)
