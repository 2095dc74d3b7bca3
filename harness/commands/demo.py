"""The verb `demo`: run the main job on synthetic motion."""

from harness.commands.flags import Verbs, add_verb
from harness.commands.run import add_all_flag, add_methods_flag, run_scenario


def add_demo(verbs: Verbs) -> None:
    text = "run the main job on synthetic motion and write its report: nothing to download, a minute"
    verb = add_verb(verbs, "demo", text, run_scenario, "seed", "out", "jobs")
    add_methods_flag(verb)
    add_all_flag(verb)
    verb.set_defaults(scenario="demo", mocap=None, report=True, jobs=2)
    verb.set_defaults(isolate=False, time_limit=None, memory_limit=None)
