"""The rules of the contract suite, which every reconstructor must satisfy.

They test behaviour, not accuracy: a method that always returns the T-pose satisfies all of them. Each rule is a
function. It returns a description of what it measured, or raises `contract_case.RuleViolation` with a description of
the fault.
"""

from collections.abc import Callable

from harness.testing.contract_case import ContractCase
from harness.testing.rules import degraded_input, reproducibility, semantics

Rule = Callable[[ContractCase], str]
RULES: dict[str, Rule] = {
    "every estimate is a valid pose": degraded_input.gives_valid_poses,
    "partial readings are tolerated": degraded_input.tolerates_partial_readings,
    "lost stations are tolerated": degraded_input.tolerates_dropouts,
    "irregular frame times are tolerated": degraded_input.tolerates_irregular_timing,
    "any reading quality is tolerated": degraded_input.tolerates_any_quality,
    "any set of stations is supported": degraded_input.supports_other_stations,
    "lag and standard deviations keep their form": semantics.keeps_lag_and_uncertainty,
    "equal input gives equal estimates": reproducibility.is_deterministic,
    "a session does not depend on earlier sessions": reproducibility.starts_without_history,
    "simultaneous sessions do not affect each other": reproducibility.isolates_sessions,
    "sessions are thread-safe": reproducibility.is_thread_safe,
    "a fitted method works in another process": reproducibility.works_in_another_process,
    "estimates are causal": reproducibility.is_causal,
    "examples are not modified": reproducibility.preserves_examples,
    "global random generators are not used": reproducibility.preserves_global_random_state,
    "the status reports lost stations": semantics.reports_tracking_loss,
    "the method's own model answers undisturbed frames": semantics.answers_by_its_model,
    "the error recovers after a disturbance": semantics.recovers_from_disturbances,
    "the posture does not depend on position and heading": semantics.is_invariant_to_placement,
    "the declared training data is consistent": semantics.declares_training_data,
}
"""Name -> rule, in the order in which they are checked."""
