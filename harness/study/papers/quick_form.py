"""The quick form of a paper's runs: a few short clips, to see that everything works. It decides no statement."""

from collections import Counter
from dataclasses import replace

from harness.experiment.scenario import Scenario

CLIPS, LONGEST_S = 2, 3.0
"""Number of test clips of each behaviour, and their length with the first second [s]."""
DATABASE_SHARE = 0.05
"""Share of the paper's frames in the databases whose speed is measured."""


def shorten_scenario(scenario: Scenario) -> Scenario:
    """The scenario with the first `CLIPS` test clips of each behaviour, of `LONGEST_S` at most; its database stays."""
    motion, taken, kept = scenario.motion, Counter[str](), list[tuple[str, str]]()
    shown = motion.behaviours * (len(motion.test) if len(motion.behaviours) == 1 else 1)
    for clip, behaviour in zip(motion.test, shown, strict=True):
        taken[behaviour] += 1
        if taken[behaviour] <= CLIPS:
            kept.append((clip, behaviour))
    test, behaviours = zip(*kept, strict=True)
    longest_s = min(motion.longest_s or LONGEST_S, LONGEST_S)
    return replace(scenario, motion=replace(motion, test=test, behaviours=behaviours, longest_s=longest_s))
