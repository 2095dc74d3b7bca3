"""Rules about side effects: on the examples, and on the global random generators."""

import random

import numpy as np

from harness.core.seeds import generator
from harness.testing.contract_case import ContractCase, hash_motions, run_session
from harness.testing.rules.assertions import RuleViolation


def preserves_examples(case: ContractCase) -> str:
    """Fitting and stepping do not modify the examples."""
    examples = case.examples()
    before = hash_motions(examples)
    reconstructor = case.method.fit(case.body, examples, generator(1, "fit"))
    run_session(reconstructor.begin(case.calibration), case.frames[:5])
    if hash_motions(examples) != before:
        raise RuleViolation("the examples were modified")
    return f"{len(examples)} takes are unchanged"


def preserves_global_random_state(case: ContractCase) -> str:
    """Random numbers come from the generator that `fit` receives, not from those of numpy and Python."""
    global_generator = np.random.mtrand._rand
    saved = global_generator.get_state(), random.getstate()
    try:
        global_generator.seed(20_110_218)
        random.seed(20_110_218)
        before = repr(global_generator.get_state(legacy=False)), random.getstate()
        run_session(case.begin_sessions(1)[0], case.frames[:5])
        if (repr(global_generator.get_state(legacy=False)), random.getstate()) != before:
            raise RuleViolation("a global random generator of numpy or Python was seeded or drawn from")
    finally:
        global_generator.set_state(saved[0])
        random.setstate(saved[1])
    return "those of numpy and Python are unchanged"
