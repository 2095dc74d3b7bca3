"""The rules that every reconstructor must keep, by kind.

They judge conduct, not accuracy: a method that always answers with the T-pose keeps them all. Each is a function that
returns what was seen where the rule holds, and raises `seen.Broken` with what was seen where it does not.
"""

from collections.abc import Callable

from harness.testing.contract_case import Trial
from harness.testing.rules import degraded_input, reproducibility, semantics, side_effects

Rule = Callable[[Trial], str]
RULES: dict[str, Rule] = {
    "every answer is a pose": degraded_input.answers_are_poses,
    "poor input is borne": degraded_input.bears_poor_input,
    "losses are borne": degraded_input.bears_losses,
    "irregular time is borne": degraded_input.bears_irregular_time,
    "any quality is borne": degraded_input.bears_any_quality,
    "any set of stations is borne": degraded_input.wears_other_stations,
    "equal input gives equal answers": reproducibility.is_deterministic,
    "a session starts from nothing": reproducibility.starts_from_nothing,
    "sessions do not meet": reproducibility.keeps_sessions_apart,
    "sessions may run in threads": reproducibility.bears_threads,
    "what was fitted may go to another process": reproducibility.bears_another_process,
    "an answer rests on no later frame": reproducibility.is_causal,
    "examples stay as they are": side_effects.leaves_examples_alone,
    "chance is the generator given": side_effects.leaves_global_chance_alone,
    "the status tells what the answer rests on": semantics.admits_being_lost,
    "the error comes back to what it was": semantics.comes_back,
    "the posture does not depend on the place": semantics.does_not_mind_where,
}
"""What they are called, in the order in which they are tried."""
