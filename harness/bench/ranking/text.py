"""Text and JSON of a report on rankings."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

from harness.bench.ranking.agreement import RankingAgreement
from harness.bench.ranking.measurement import METHODS, PLACES_METHOD, RankingReport
from harness.core.number_format import Interval, count_noun, format_fixed, format_p_value
from harness.core.text_table import Table
from harness.results.findings import PairAgreement, PairVerdict, SideDifference

VERDICTS: Mapping[PairVerdict, str] = {"contradict": "reversed", "agree": "agree", "cannot tell": "cannot tell"}


def format_rankings(report: RankingReport) -> str:
    """All rankings with their pairs, then one line for each ranking."""
    blocks = []
    for (behaviour, kind), ranking in report.rankings.items():
        by = "" if kind == METHODS else f", by {PLACES_METHOD}"
        head = f"{behaviour}, {kind}{by}: {_performers(ranking)}"
        lines = [head, "", *_means_table(ranking).lines(), "", *_pairs_table(ranking).lines()]
        lines += [f"left out: {item}, {why}" for item, why in ranking.left_out.items()]
        blocks.append("\n".join(lines))
    failed = [f"FAILED {cell}: {text.strip().splitlines()[-1]}" for cell, text in report.failures.items()]
    return "\n\n".join([*blocks, "\n".join([*failed, *_statements(report)])])


def _performers(ranking: RankingAgreement) -> str:
    return f"{len(ranking.builtin)} built-in and {count_noun(len(ranking.real), 'real performer')}"


def _means_table(ranking: RankingAgreement) -> Table:
    """Mean errors and ranks on both sides."""
    real = sorted(ranking.means, key=lambda item: ranking.means[item][1])
    rows = [
        [item, format_fixed(on_builtin, 2), str(rank), format_fixed(on_real, 2), str(real.index(item) + 1)]
        for rank, (item, (on_builtin, on_real)) in enumerate(ranking.means.items(), start=1)
    ]
    return Table(["joint angle [deg]", "built-in", "rank", "real", "rank"], rows, text_columns=1)


def _pairs_table(ranking: RankingAgreement) -> Table:
    """Every pair with its differences, the reversed ones first."""
    head = [
        "pair",
        "verdict",
        "built-in, a - b [deg]",
        "95 % interval",
        "real",
        "95 % interval",
        "p",
        "performers needed",
        "why",
    ]
    order = list(VERDICTS)
    pairs = sorted(zip(ranking.pairs, ranking.enough, strict=True), key=lambda each: order.index(each[0].verdict))
    rows = [
        [
            *(f"{pair.a}, {pair.b}", VERDICTS[pair.verdict]),
            *(*_difference(pair.simulated), *_difference(pair.device)),
            *(format_p_value(pair.p_holm), "" if enough is None else str(enough)),
            pair.why if pair.verdict == "cannot tell" else "",
        ]
        for pair, enough in pairs
    ]
    return Table(head, rows, text_columns=2)


def _difference(side: SideDifference) -> tuple[str, str]:
    number = Interval.of(side.mean, side.low, side.high, signed=True)
    return number.number, number.ends


def _statements(report: RankingReport) -> Iterator[str]:
    for (behaviour, kind), ranking in report.rankings.items():
        yield f"{behaviour}, {kind}: {statement(ranking)}"


def statement(ranking: RankingAgreement) -> str:
    """Kendall's tau with its interval and units, the number of pairs that agree, and the cost of a choice."""
    tau = f"Kendall's tau {Interval.of(ranking.tau, ranking.low, ranking.high)}"
    if ranking.reason:
        return f"{tau}, without an interval ({ranking.reason}). No pair can be told. {_cost_of_choice(ranking)}".strip()
    counts = {verdict: len(ranking.with_verdict(verdict)) for verdict in VERDICTS}
    reversed_pairs = "; ".join(map(_order, ranking.with_verdict("contradict")))
    sentences = [
        f"{tau}, {_performers(ranking)}.",
        f"Of {count_noun(len(ranking.pairs), 'pair')}: {counts['agree']} agree, {counts['contradict']} reversed, "
        f"{counts['cannot tell']} cannot be told.",
        f"Better on built-in motion and worse on real motion: {reversed_pairs}." if reversed_pairs else "",
        _cost_of_choice(ranking),
    ]
    return " ".join(filter(None, sentences))


def _cost_of_choice(ranking: RankingAgreement) -> str:
    """What the best item on built-in motion loses on real motion; "" without items."""
    if not ranking.means:
        return ""
    chosen, best = (min(ranking.means, key=lambda item: ranking.means[item][side]) for side in (0, 1))
    if chosen == best:
        return f"{best} has the lowest error on both."
    loss = ranking.means[chosen][1] - ranking.means[best][1]
    return f"On real motion {chosen}, best on built-in motion, errs {loss:.2f} deg more than {best}, best there."


def _order(pair: PairAgreement) -> str:
    return f"{pair.a} than {pair.b}"


def rankings_content(report: RankingReport) -> dict[str, Any]:
    """The content of the JSON output."""
    return {
        "failures": dict(report.failures),
        "rankings": [
            {"behaviour": behaviour, "kind": kind, **asdict(ranking), "reason": ranking.reason}
            for (behaviour, kind), ranking in report.rankings.items()
        ],
    }
