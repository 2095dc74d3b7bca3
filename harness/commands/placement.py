"""The verb `placement`: find out how many stations to wear, and where."""

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING

from harness.commands.flags import (
    Verbs,
    add_verb,
    folder_of,
    positive_float,
    positive_int,
    process_count,
    refuse_flags,
    split_list,
)
from harness.commands.output import long_work, print_result, print_status, record_content, this_command, this_words
from harness.core.progress import show_steps
from harness.errors import BadInput, Outcome

if TYPE_CHECKING:
    from harness.results.findings import PlacementFindings, StatisticalPower
    from harness.study.placement.question import PlacementQuestion

_QUESTION_FLAGS = (
    *("stations", "behaviour", "places", "with", "cost", "symmetric", "method", "second_method", "split", "noise"),
    *("physics", "baud", "effort", "minutes", "clips", "seed"),
)
_EXAMPLE = "harness placement --stations 3 --behaviour table_tennis"


def add_placement(verbs: Verbs) -> None:
    text = "find out where to wear how many stations, for a behaviour or by a study; the same command resumes"
    verb = add_verb(verbs, "placement", text, run_placement, "out", "mocap")
    text = "a TOML file, or the name of a shipped study, such as walking; without one, the options below ask a question"
    verb.add_argument("study", nargs="?", help=text)
    text = "clips computed at the same time (default 2)"
    verb.add_argument("--jobs", type=process_count, default=2, metavar="N", help=text)
    question = verb.add_argument_group("question", f"instead of a study, such as `{_EXAMPLE}`")
    text = "number of stations, such as 3 or 2-4 (default 3; one more than those of --with)"
    question.add_argument("--stations", type=parse_sizes, metavar="N", help=text)
    text = (
        "walking, boxing, jumping, golf or table_tennis of the built-in motion, or behaviours of the library with "
        "--mocap; several are separated by commas (default walking)"
    )
    question.add_argument("--behaviour", metavar="A,B", help=text)
    text = "places to choose from (default: one on each of eleven segments; `harness list places` names all)"
    question.add_argument("--places", metavar="A,B", help=text)
    text = "stations that are worn in any case, such as head,left_hand; --stations counts them too"
    question.add_argument("--with", metavar="A,B", help=text)
    text = "costs of places, such as head=2,wrist=1 (default 1 each; wrist is either wrist): shows error against cost"
    question.add_argument("--cost", type=parse_costs, metavar="A=N,B=N", help=text)
    text = "left and right are one place: both sides are worn or neither, which counts as two stations"
    question.add_argument("--symmetric", action="store_true", default=None, help=text)
    question.add_argument("--method", metavar="NAME", help="the method whose error counts (default expert_map)")
    text = "a method that the answer is repeated with, or none (default ik; expert_map for ik itself)"
    question.add_argument("--second-method", metavar="NAME", help=text)
    text = "subject: methods learn from other performers than those tested (default sequence: from other takes)"
    question.add_argument("--split", choices=["sequence", "subject"], help=text)
    text = "noise preset of the tracker (default: default)"
    question.add_argument("--noise", choices=["clean", "noise", "default"], help=text)
    text = (
        "simulate ultrasound, line of sight and inertia under this constellation, such as hall (default: noise alone)"
    )
    question.add_argument("--physics", metavar="NAME", help=text)
    text = "rate of the serial line, which limits the frames of many stations (default 115200)"
    question.add_argument("--baud", type=positive_int, metavar="N", help=text)
    text = "how thoroughly sets are searched, as a number of cells (default normal); the answer does not depend on time"
    question.add_argument("--effort", choices=["quick", "normal", "thorough"], help=text)
    text = "chooses the effort that takes about so long on two quiet cores; a slower computer takes longer"
    question.add_argument("--minutes", type=positive_float, metavar="N", help=text)
    text = "number of clips of each behaviour to choose on, every set on all of them, instead of an effort"
    question.add_argument("--clips", type=positive_int, metavar="N", help=text)
    question.add_argument("--seed", type=int, help="seed of motion and noise (default 1)")


def parse_sizes(text: str) -> tuple[int, int]:
    """Fewest and most stations from 3 or 2-4, for argparse."""
    match = re.fullmatch(r"([0-9]{1,3})(?:-([0-9]{1,3}))?", text)
    if not match:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of stations, such as 3, and no range, such as 2-4")
    return int(match[1]), int(match[2] or match[1])


def parse_costs(text: str) -> dict[str, float]:
    """Costs by place from head=2,wrist=1.5, for argparse."""
    costs: dict[str, float] = {}
    for entry in text.split(","):
        name, _, number = (part.strip() for part in entry.partition("="))
        if not name or name in costs:
            raise argparse.ArgumentTypeError(f"{text!r} is no list of costs, such as head=2,wrist=1")
        costs[name] = positive_float(number)
    return costs


def run_placement(args: argparse.Namespace) -> Outcome:
    from harness.experiment.workers import process_executor
    from harness.report.placement.answer import placement_sentence
    from harness.report.placement.page import placement_text, write_placement_page
    from harness.report.placement.question_answer import size_sentences
    from harness.results.files import FINDINGS
    from harness.study.placement import placement_study

    question = _read_question(args)
    name = question.name if question else Path(args.study).stem.removeprefix("placement_")
    out = folder_of(args, f"placement_{name}")
    with long_work(out, "cells") as bar, process_executor(args.jobs) as each:
        findings: PlacementFindings
        findings, outcome = placement_study.run_placement(
            question or args.study,
            out,
            folder=args.mocap,
            executor=each,
            jobs=args.jobs,
            command=this_command(),
            progress=bar,
            announce=_announce,
        )
    with show_steps("parts of the report"):
        page = write_placement_page(out)
    answer, beside = placement_sentence(findings), size_sentences(findings)
    content = {"answer": answer, "other_sizes": beside, **record_content(findings, out=out, report=page)}
    lines = (placement_text(findings), "", f"findings: {out / FINDINGS}", f"report: {page}", answer, *beside)
    following = ["plot", out] if outcome is Outcome.PASS else this_words()
    return print_result(args, content, *lines, outcome=outcome, following=following)


def _read_question(args: argparse.Namespace) -> "PlacementQuestion | None":
    """The question on the command line; None for a study. BadInput for both and for neither."""
    from harness.body import select_places
    from harness.study.placement.effort import effort_within
    from harness.study.placement.question import DEFAULT_METHOD, DEFAULT_STATIONS, PlacementQuestion

    if args.study is not None:
        advice = "A study has its own: name a study or ask a question."
        refuse_flags(args, _QUESTION_FLAGS, f"with the study {args.study}", advice)
        return None
    if all(getattr(args, name) is None for name in _QUESTION_FLAGS):
        raise BadInput("Neither a study nor a question.", f"Type: {_EXAMPLE}; or: harness placement walking")
    limits = [name for name in ("effort", "minutes", "clips") if getattr(args, name) is not None]
    if len(limits) > 1:
        raise BadInput(f"--{limits[0]} with --{limits[1]}.", "Each of them limits the search: name one.")
    base = tuple(split_list(getattr(args, "with")))
    usual = len(select_places(base)) + 1 if base else DEFAULT_STATIONS
    fewest, most = args.stations or (usual, usual)
    return PlacementQuestion(
        fewest,
        most,
        tuple(split_list(args.behaviour)) or ("walking",),
        places=tuple(split_list(args.places)),
        method=args.method or DEFAULT_METHOD,
        noise=args.noise or "default",
        constellation=args.physics or "",
        effort=effort_within(args.minutes) if args.minutes is not None else args.effort or "",
        clips=args.clips or 0,
        seed=1 if args.seed is None else args.seed,
        split=args.split or "sequence",
        base=base,
        costs=args.cost or {},
        symmetric=bool(args.symmetric),
        baud=args.baud or 0,
        second_method=args.second_method or "",
    )


def _announce(news: "StatisticalPower | str") -> None:
    """Tell on stderr what the cells can show and how long they take, or how a search goes on."""
    from harness.report.placement.power_wording import power_sentences

    for line in [news] if isinstance(news, str) else power_sentences(news):
        print_status(line)
