"""The page of a reproduced paper: count of verdicts, every claim, then each experiment; and its tables in a README."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import quote

from harness.core.number_format import count_noun
from harness.report.kit.chart import clear_plots
from harness.report.kit.marked_block import describe_code, replace_block
from harness.report.kit.markup import Markup, join, tag
from harness.report.kit.page import (
    Badge,
    Block,
    BrowserOnly,
    Bullets,
    Code,
    DataTable,
    Drawing,
    Page,
    Prose,
    Section,
    Stack,
    Tally,
    TerminalOnly,
    json_listing,
)
from harness.report.kit.page_html import write_page
from harness.report.kit.page_text import render_text, table_lines
from harness.report.kit.statement_lines import MARKS, WIDTH, statement_head, statement_row
from harness.report.kit.text import describe_motion_source, to_file_name
from harness.report.paper.charts import figure_charts, figure_table, is_measured
from harness.results.files import FINDINGS
from harness.results.findings import (
    BenchmarkStatement,
    FindingsTable,
    PaperExperiment,
    PaperFindings,
    Reading,
    Verdict,
    read_findings,
)

READINGS: Mapping[Reading, str] = {"as printed": "With the methods as printed: ", "ours": "With our methods: "}
"""Reading -> start of its sentence."""
MEANINGS: Mapping[Verdict, str] = {
    "reproduced": "the 95 % interval of the paired difference lies on the published side, and its p after Holm is at "
    "most 0.05; or a printed value is met (an error within 25 %)",
    "same": "the whole interval lies within the margin of a comparison: the difference is too small to matter",
    "not reproduced": "the interval lies on the other side; or a printed value is not met",
    "cannot tell": "the interval contains zero, there are too few units, or the difference is not significant among "
    "the printed statements (Holm)",
    "not comparable": "the printed value is for other motion or conditions",
    "not run": "not measured here",
}
KINDS: tuple[Verdict, ...] = tuple(MEANINGS)
"""All verdicts on claims, in the order of the tables."""
_CLAIMS = (
    "Difference: mean of the paired differences over units (performers, or clips where a note says so) and its 95 % "
    "interval; positive values agree with the paper. p: by sign flips (by Welch's test where units do not pair), after "
    "Holm's correction for all printed statements of the paper with the same version of the methods (as printed, "
    "ours). The text under a claim gives the reason for its verdict. Kind: the paper prints a printed statement; a "
    "derived one follows from those or is our interpretation of a word; a repeated one asks one more method; speed "
    "compares today's machines with the paper's. Only printed statements count in the headline."
)
_STATEMENTS = (
    "As printed: the equations of the paper, without additions. Ours: the methods of this project that extend them. "
    "Errors are means over units. The headline counts these verdicts. The next table adds differences, intervals and "
    "reasons."
)
_VARIANT = re.compile(r":(literal|chai2005)\b")
"""Names of methods as printed, which the statement leaves out."""
_FACTS = {"harness": "harness", "commit": "commit", "dirty": "uncommitted changes", "python": "python"}


def write_paper_page(folder: Path) -> Path:
    """Write FOLDER/plots and FOLDER/report.html of the study in `folder`; returns the path of the page.

    BadFile if there are no findings.
    """
    page = paper_page(read_findings(folder / FINDINGS), folder)
    return write_page(page, folder / "report.html", clear_plots(folder))


def paper_text(findings: PaperFindings) -> str:
    """The page for a terminal: every claim with its verdict, experiment by experiment."""
    return render_text(paper_page(findings), WIDTH)


def paper_page(findings: PaperFindings, folder: Path | None = None) -> Page:
    """The page of a study; runs in its `folder` become links."""
    claims = all_claims(findings)
    printed = [claim for claim in claims if claim.kind == "printed"]
    groups: list[list[object]] = []
    for experiment in findings.experiments:
        if experiment.claims:
            groups += [[_link(experiment)], *map(statement_row, experiment.claims)]
    return Page(
        verb="paper",
        name=f"{findings.paper} · {findings.motion}",
        headline=claims_sentence(claims),
        lead=[Tally(count_verdicts(printed), MARKS, MEANINGS)] if claims else [],
        facts={
            "Paper": findings.reference,
            "Motion": describe_motion_source(findings.motion),
            "Made by": f"{findings.command} (seed {findings.seed})",
        },
        sections=[
            Section("Printed statements", "statements", [statements_table(findings)], terminal=False),
            Section("All claims", "claims", [_claims_table(groups)], terminal=False),
            *(_experiment(findings, experiment, folder) for experiment in findings.experiments),
            Section("Differences from the paper in several experiments", "throughout", list(_shared_blocks(findings))),
            Section("Databases and clips", "databases", [*map(_table, findings.tables)], terminal=False),
            Section("Circumstances", "circumstances", _circumstances(findings), terminal=False),
        ],
    )


def all_claims(findings: PaperFindings) -> list[BenchmarkStatement]:
    """The claims of all experiments, in their order."""
    return [claim for experiment in findings.experiments for claim in experiment.claims]


def count_verdicts(claims: Sequence[BenchmarkStatement]) -> dict[Verdict, int]:
    """Verdict -> number of claims; "not run" is left out if there are none."""
    counts = Counter(claim.verdict for claim in claims)
    return {kind: counts[kind] for kind in KINDS if counts[kind] or kind != "not run"}


def printed_claims(claims: Iterable[BenchmarkStatement], reading: Reading) -> list[BenchmarkStatement]:
    """The claims of statements that the paper prints, with the methods of one reading; those of no method are of both.

    A reading without any claim of its own has none.
    """
    found = [claim for claim in claims if claim.kind == "printed" and claim.reading in ("", reading)]
    return found if any(claim.reading == reading for claim in found) else []


def claims_sentence(claims: Sequence[BenchmarkStatement]) -> str:
    """The number of printed statements of each verdict: with the methods as printed, and with ours."""
    readings = {reading: printed_claims(claims, reading) for reading in READINGS}
    found = {READINGS[reading]: some for reading, some in readings.items() if some}
    if not found and claims:
        found = {"": [claim for claim in claims if claim.kind == "printed"] or list(claims)}
    if not found:
        return "No published statement was compared with a measured result."
    return " ".join(f"{_counts(some, start)}." for start, some in found.items())


def _counts(claims: Sequence[BenchmarkStatement], start: str) -> str:
    first, *others = count_verdicts(claims).items()
    counted = f"{start}{first[1]} of {count_noun(len(claims), 'printed statement')} {first[0]}"
    return ", ".join([counted, *(f"{count} {kind}" for kind, count in others if count)])


def claims_table(claims: Sequence[BenchmarkStatement]) -> DataTable:
    """Each published statement next to the measured result, with the reason for its verdict."""
    return _claims_table([statement_row(claim) for claim in claims])


def _claims_table(rows: Sequence[Sequence[object]]) -> DataTable:
    head = statement_head("claim", "published")
    return DataTable(head, rows, caption=_CLAIMS, label="claims", cards=True)


def statements_table(findings: PaperFindings) -> DataTable:
    """Printed statements, each once, with two results: of the methods as printed, and of ours."""
    found: dict[tuple[str, str], dict[Reading, BenchmarkStatement]] = {}
    for claim in all_claims(findings):
        if claim.kind == "printed":
            readings: tuple[Reading, ...] = (claim.reading,) if claim.reading else tuple(READINGS)
            row = found.setdefault((_VARIANT.sub("", claim.text), claim.target), {})
            row |= dict.fromkeys(readings, claim)
    rows = [
        [*statement, *(_result(claims.get(reading)) for reading in READINGS)] for statement, claims in found.items()
    ]
    head = ["statement", "published", *READINGS]
    return DataTable(head, rows, caption=_STATEMENTS, label="printed statements", cards=True)


def _result(claim: BenchmarkStatement | None) -> object:
    return Stack(Badge(claim.verdict, MARKS[claim.verdict]), claim.measured) if claim else ""


def statements_text(findings: PaperFindings) -> str:
    """The printed statements with the results of both readings, in lines of at most `WIDTH` characters."""
    claims, table = all_claims(findings), statements_table(findings)
    head = render_text(Page("", "", findings.reference, {}, []), WIDTH).split("\n")
    head += [f"{findings.paper} on {findings.motion}, seed {findings.seed}.", claims_sentence(claims)]
    others = sum(claim.kind != "printed" for claim in claims)
    more = (
        ["", f"{count_noun(others, 'further claim')}: derived, repeated or of speed; see the page."] if others else []
    )
    return "\n".join([*head, *(["", *table_lines(table, WIDTH)] if table.rows else []), *more])


def _experiment(findings: PaperFindings, experiment: PaperExperiment, folder: Path | None) -> Section:
    """Question, verdicts, differences from the paper, figures, tables, notes and runs."""
    counts = ", ".join(f"{count} {kind}" for kind, count in count_verdicts(experiment.claims).items() if count)
    link = tag("a", "Claims of this experiment", href="#claims")
    shared = shared_differences(findings)
    differences = [text for text in experiment.differences if text not in shared]
    also = tag("p", "Also the ", tag("a", "differences of several experiments", href="#throughout"), ".")
    runs = [_run(name, folder) for name in experiment.runs]
    charts = figure_charts(findings, experiment)
    figures: list[Block] = [
        Drawing(draw, figure_table(figure), "Numbers of this figure")
        if is_measured(figure)
        else Prose(f"{figure_table(figure).title}: nothing was measured.")
        for draw, figure in zip(charts, experiment.figures, strict=True)
    ]
    none = Prose("no published statement to compare with")
    blocks: list[Block] = [
        TerminalOnly([claims_table(experiment.claims) if experiment.claims else none]),
        BrowserOnly(
            [
                *([Prose(experiment.question)] if experiment.question else []),
                *([tag("p", link, ": ", tag("b", counts), ".")] if counts else []),
            ]
        ),
        Bullets(differences, "Differences from the paper", "difference from the paper: "),
        BrowserOnly(
            [
                *([also] if len(differences) < len(experiment.differences) else []),
                *figures,
                *map(_table, experiment.tables),
                Bullets(experiment.notes, "Further results"),
                Bullets(runs, "Runs"),
            ]
        ),
    ]
    return Section(experiment.title, anchor(experiment), blocks, f"{experiment.name}: {experiment.title}")


def _table(content: FindingsTable) -> Block:
    if not content.rows:
        return Prose(f"{content.title}: nothing was measured.")
    return DataTable(content.columns, content.rows, content.title)


def anchor(experiment: PaperExperiment) -> str:
    """The anchor of the experiment's section."""
    return f"experiment-{to_file_name(experiment.name)}"


def _link(experiment: PaperExperiment) -> Markup:
    return tag("a", experiment.title, href=f"#{anchor(experiment)}")


def shared_differences(findings: PaperFindings) -> dict[str, list[PaperExperiment]]:
    """Difference from the paper -> the experiments that share it, for those that several experiments share."""
    experiments_of: dict[str, list[PaperExperiment]] = {}
    for experiment in findings.experiments:
        for text in dict.fromkeys(experiment.differences):
            experiments_of.setdefault(text, []).append(experiment)
    return {text: experiments for text, experiments in experiments_of.items() if len(experiments) > 1}


def _shared_blocks(findings: PaperFindings) -> Iterable[Block]:
    """Differences from the paper that several experiments share, a list for each group of experiments."""
    groups: dict[tuple[str, ...], list[str]] = {}
    names = {experiment.name: experiment for experiment in findings.experiments}
    for text, experiments in shared_differences(findings).items():
        groups.setdefault(tuple(experiment.name for experiment in experiments), []).append(text)
    for group, texts in groups.items():
        links = [join("; " if n else "", _link(names[name])) for n, name in enumerate(group)]
        yield BrowserOnly([tag("p", *(["In all experiments:"] if len(group) == len(names) else ["In ", *links, ":"]))])
        yield TerminalOnly([Prose(f"in {'all' if len(group) == len(names) else ', '.join(group)}:")])
        yield Bullets(texts)


def _run(name: str, folder: Path | None) -> str:
    """The name of a run, as a link if its page or folder exists."""
    target = run_link(folder, name) if folder else None
    return tag("a", name, href=f"./{quote(target)}") if target else name


def _circumstances(findings: PaperFindings) -> list[Block]:
    """The command that repeats the study, and the versions with which the page was made."""
    circumstances = findings.circumstances
    facts = {"seed": findings.seed, **{_FACTS[name]: circumstances[name] for name in _FACTS if name in circumstances}}
    return [
        Code(findings.command),
        Bullets([f"{name}: {_format_fact(value)}" for name, value in facts.items()]),
        *([json_listing(circumstances, "All versions and circumstances")] if circumstances else []),
    ]


def _format_fact(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "unknown" if value is None else str(value)


def run_link(folder: Path, name: str) -> str | None:
    """The page of a run, or its folder, relative to `folder`; None if it is missing or lies outside `folder`."""
    path = PurePosixPath(name)
    run = folder / path
    if not path.parts or not run.is_dir() or not run.resolve().is_relative_to(folder.resolve()):
        return None
    return f"{path}/report.html" if (run / "report.html").is_file() else f"{path}/"


def update_readme(readme: Path, findings: PaperFindings) -> None:
    """Replace the tables of this paper and motion in `readme`, or append them; raises what `replace_block` raises."""
    name = re.sub(r"[^\w.]+", "-", f"{findings.paper} {findings.motion}").strip("-")
    title, made_by = f"### {findings.paper}, {findings.motion}", describe_code(findings.circumstances)
    block = [f"    {line}".rstrip() for line in (findings.command, "", *statements_text(findings).split("\n"))]
    replace_block(readme, f"paper {name}", [title, "", f"Made by {made_by}:", "", *block])
