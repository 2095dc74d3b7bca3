"""Rules about what is not a method's own: examples, and the generators that everyone draws from."""

import random

import numpy as np

from harness.core.seeds import generator
from harness.testing.contract_case import ContractCase, hash_motions, run_session
from harness.testing.rules.assertions import RuleViolation


def preserves_examples(trial: ContractCase) -> str:
    """Fitting and following change none of the examples."""
    examples = trial.examples()
    before = hash_motions(examples)
    reconstructor = trial.method.fit(trial.body, examples, generator(1, "fit"))
    run_session(reconstructor.begin(trial.calibration), trial.frames[:5])
    if hash_motions(examples) != before:
        raise RuleViolation("the examples are others than before")
    return f"{len(examples)} takes"


def preserves_global_random_state(trial: ContractCase) -> str:
    """Chance comes from the generator that `fit` is given: numpy's and Python's own are left alone."""
    numpys = np.random.mtrand._rand
    kept = numpys.get_state(), random.getstate()
    try:
        numpys.seed(20_110_218)
        random.seed(20_110_218)
        before = repr(numpys.get_state(legacy=False)), random.getstate()
        run_session(trial.begin_sessions(1)[0], trial.frames[:5])
        if (repr(numpys.get_state(legacy=False)), random.getstate()) != before:
            raise RuleViolation("a global generator was seeded or drawn from")
    finally:
        numpys.set_state(kept[0])
        random.setstate(kept[1])
    return "numpy's and Python's own untouched"
