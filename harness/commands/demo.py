"""The verb `demo`: run the main job on synthetic motion."""

import argparse

from harness.commands.flags import Verbs, add_verb
from harness.commands.output import print_status
from harness.commands.run import add_all_flag, add_methods_flag, run_scenario
from harness.errors import Outcome


def add_demo(verbs: Verbs) -> None:
    text = "run the main job on synthetic motion and write its report: nothing to download, a minute"
    verb = add_verb(verbs, "demo", text, run_demo, "seed", "out", "jobs")
    add_methods_flag(verb)
    add_all_flag(verb)
    verb.set_defaults(scenario="demo", mocap=None, report=True, jobs=2)
    verb.set_defaults(isolate=False, time_limit=None, memory_limit=None)


def run_demo(args: argparse.Namespace) -> Outcome:
    """Say what comes before the imports, which take a second, and run the demo."""
    print_status("demo: synthetic motion of twelve performers")
    return run_scenario(args)
