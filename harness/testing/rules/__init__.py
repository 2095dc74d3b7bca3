"""The rules that every reconstructor must keep, by kind.

They judge conduct, not accuracy: a method that always answers with the T-pose keeps them all. Each is a function that
returns what was seen where the rule holds, and raises `seen.Broken` with what was seen where it does not.
"""

from collections.abc import Callable

from harness.testing.contract_case import ContractCase
from harness.testing.rules import degraded_input, reproducibility, semantics, side_effects

Rule = Callable[[ContractCase], str]
RULES: dict[str, Rule] = {
    "every answer is a pose": degraded_input.gives_valid_poses,
    "poor input is borne": degraded_input.tolerates_partial_readings,
    "losses are borne": degraded_input.tolerates_dropouts,
    "irregular time is borne": degraded_input.tolerates_irregular_timing,
    "any quality is borne": degraded_input.tolerates_any_quality,
    "any set of stations is borne": degraded_input.supports_other_stations,
    "equal input gives equal answers": reproducibility.is_deterministic,
    "a session starts from nothing": reproducibility.starts_without_history,
    "sessions do not meet": reproducibility.isolates_sessions,
    "sessions may run in threads": reproducibility.is_thread_safe,
    "what was fitted may go to another process": reproducibility.works_in_another_process,
    "an answer rests on no later frame": reproducibility.is_causal,
    "examples stay as they are": side_effects.preserves_examples,
    "chance is the generator given": side_effects.preserves_global_random_state,
    "the status tells what the answer rests on": semantics.reports_tracking_loss,
    "the error comes back to what it was": semantics.recovers_from_disturbances,
    "the posture does not depend on the place": semantics.is_invariant_to_placement,
}
"""What they are called, in the order in which they are tried."""
