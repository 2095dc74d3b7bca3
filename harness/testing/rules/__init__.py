"""The rules that every reconstructor must keep, by kind.

They judge conduct, not accuracy: a method that always answers with the T-pose keeps them all. Each is a function that
returns what was seen where the rule holds, and raises `seen.Broken` with what was seen where it does not.
"""

from collections.abc import Callable

from harness.testing.rules import inputs, manners, meaning, sameness
from harness.testing.trial import Trial

Rule = Callable[[Trial], str]
RULES: dict[str, Rule] = {
    "every answer is a pose": inputs.answers_are_poses,
    "poor input is borne": inputs.bears_poor_input,
    "losses are borne": inputs.bears_losses,
    "irregular time is borne": inputs.bears_irregular_time,
    "any quality is borne": inputs.bears_any_quality,
    "any set of stations is borne": inputs.wears_other_stations,
    "equal input gives equal answers": sameness.is_deterministic,
    "a session starts from nothing": sameness.starts_from_nothing,
    "sessions do not meet": sameness.keeps_sessions_apart,
    "sessions may run in threads": sameness.bears_threads,
    "what was fitted may go to another process": sameness.bears_another_process,
    "an answer rests on no later frame": sameness.is_causal,
    "examples stay as they are": manners.leaves_examples_alone,
    "chance is the generator given": manners.leaves_global_chance_alone,
    "the status tells what the answer rests on": meaning.admits_being_lost,
    "the error comes back to what it was": meaning.comes_back,
    "the posture does not depend on the place": meaning.does_not_mind_where,
}
"""What they are called, in the order in which they are tried."""
