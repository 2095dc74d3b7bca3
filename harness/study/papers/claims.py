"""Evaluation of a paper's claims with errors by unit, and Holm's correction for the number of printed statements."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from harness.compare import MIN_UNITS, SIGNIFICANCE, compare_paired, count_needed, holm, margin_of, sign_flip_p
from harness.core.number_format import format_change_percent, format_p_value
from harness.results import PRIMARY_METRIC
from harness.results.findings import BenchmarkStatement, Reading, StatementKind, Verdict

Errors = Mapping[str, float]
"""Unit of statistics -> error; all are of one kind (see `units`)."""
TOLERANCE = 0.25
"""Largest relative difference to a published figure that counts as reproduced."""


def claim_lower_error(
    text: str,
    less: Errors,
    more: Errors,
    *,
    published: str = "order",
    unit: str = "deg",
    why: str = "",
    kind: StatementKind = "printed",
    reading: Reading = "",
) -> BenchmarkStatement:
    """Claim that `less` is below `more`, tested by the paired interval.

    An interval within the margin of joint angles is *same*. `why` explains a claim that is not reproduced.
    """
    difference = compare_paired(more, less)
    if difference.mean is None:
        return BenchmarkStatement(
            text, published, "not measured", "not run", difference.why, unit=unit, kind=kind, reading=reading
        )
    means = [sum(side[unit] for unit in difference.units) / len(difference.units) for side in (less, more)]
    verdict, reason = difference.verdict, difference.why
    margin = margin_of(PRIMARY_METRIC).of(means[1])
    if unit == "deg" and difference.low is not None and -margin <= difference.low <= (difference.high or 0.0) <= margin:
        verdict, reason = "same", f"the whole interval lies within the margin, {margin:.2f} {unit}"
    return BenchmarkStatement(
        text=text,
        target=published,
        measured=f"{means[0]:.2f} against {means[1]:.2f} {unit}",
        verdict=verdict,
        kind=kind,
        reading=reading,
        why="" if verdict == "reproduced" else "; ".join(filter(None, (reason, why))),
        clips=len(difference.units),
        value=difference.mean,
        low=difference.low,
        high=difference.high,
        unit=unit,
        p=_paired_p(more, less, difference.units),
    )


def claim_noninferior(
    text: str,
    errors: Errors,
    reference: Errors,
    *,
    published: str = "order",
    why: str = "",
    kind: StatementKind = "printed",
    reading: Reading = "",
) -> BenchmarkStatement:
    """Claim that `errors` [deg] exceed `reference` by less than the margin of joint angles (non-inferiority).

    *Reproduced* when the 95 % interval of the excess ends below the margin, *not reproduced* when it begins above. The
    difference of the claim is margin - excess, so that positive values agree with the paper. `p` is that of this
    difference.
    """
    excess = compare_paired(errors, reference)
    if excess.mean is None:
        return BenchmarkStatement(
            text, published, "not measured", "not run", excess.why, unit="deg", kind=kind, reading=reading
        )
    means = [sum(side[unit] for unit in excess.units) / len(excess.units) for side in (errors, reference)]
    margin = margin_of(PRIMARY_METRIC).of(means[1])
    allowed = {name: reference[name] + margin for name in excess.units}
    room = compare_paired(allowed, errors)
    reason = {
        "reproduced": "",
        "not reproduced": f"the excess is larger than the margin, {margin:.2f} deg",
        "cannot tell": f"the interval of the excess contains the margin, {margin:.2f} deg",
    }[room.verdict]
    reason = room.why if room.low is None else reason
    return BenchmarkStatement(
        text=text,
        target=published,
        measured=f"{means[0]:.2f} against {means[1]:.2f} deg, margin {margin:.2f}",
        verdict=room.verdict,
        why="" if room.verdict == "reproduced" else "; ".join(filter(None, (reason, why))),
        clips=len(room.units),
        value=room.mean,
        low=room.low,
        high=room.high,
        unit="deg",
        kind=kind,
        reading=reading,
        p=_paired_p(allowed, errors, room.units),
    )


WORST_FIRST: tuple[Verdict, ...] = ("not run", "not reproduced", "cannot tell", "same", "reproduced")


def claim_all(text: str, parts: Mapping[str, BenchmarkStatement]) -> BenchmarkStatement:
    """One claim that holds when every part does (intersection-union test).

    The verdict and the figures are those of the worst part, and the reason names it. All parts must hold, so p is the
    largest. One part suffices to refute the claim; its own p is then multiplied by the number of parts (Bonferroni).
    """
    name, worst = min(parts.items(), key=lambda part: (WORST_FIRST.index(part[1].verdict), part[1].value or 0.0))
    found = [part.p for part in parts.values() if part.p is not None]
    p = max(found) if len(found) == len(parts) else None
    if worst.verdict == "not reproduced":
        p = None if worst.p is None else min(1.0, len(parts) * worst.p)
    return replace(
        worst,
        text=text,
        measured="; ".join(f"{part.measured} ({name})" for name, part in parts.items()),
        why=f"{name}: {worst.why}" if worst.why else "",
        p=p,
    )


def claim_decreasing(
    text: str, series: Mapping[str, Errors], what: str, *, kind: StatementKind = "printed", reading: Reading = ""
) -> BenchmarkStatement:
    """Claim that errors decrease from each entry of `series` to the next; `what` names the entries in words.

    Every step must decrease; the difference of the claim is that of the worst step.
    """
    names = list(series)
    steps = {
        f"from {before} to {after} {what}": claim_lower_error(
            text, series[after], series[before], kind=kind, reading=reading
        )
        for before, after in pairwise(names)
    }
    if not steps or any(step.verdict == "not run" for step in steps.values()):
        why = f"no unit has results for all {what}"
        return BenchmarkStatement(text, "order", "not measured", "not run", why, unit="deg", kind=kind, reading=reading)
    means = ", ".join(f"{sum(errors.values()) / len(errors):.2f}" for errors in series.values())
    return replace(claim_all(text, steps), measured=f"{means} deg with {', '.join(names)} {what}")


def correct_claims(claims: Sequence[BenchmarkStatement]) -> list[BenchmarkStatement]:
    """Correct the p of a paper's printed statements for their number, by the method of Holm (1979).

    The statements of each reading are one family. A verdict by a difference that is not significant in its family
    becomes *cannot tell*. The p of a sign-flip test of n units is 2^(1 - n) or more, so the reason says where there are
    too few units, and how many would do. Claims of other kinds, and those without a p, stay as they are.
    """
    corrected = list(claims)
    for reading in {claim.reading for claim in claims}:
        family = [at for at, claim in enumerate(claims) if _is_tested(claim) and claim.reading == reading]
        for at, p in zip(family, holm([claims[at].p or 0.0 for at in family]), strict=True):
            corrected[at] = _with_correction(claims[at], p, len(family))
    return corrected


def _is_tested(claim: BenchmarkStatement) -> bool:
    return claim.kind == "printed" and claim.p is not None


def _with_correction(claim: BenchmarkStatement, p: float, statements: int) -> BenchmarkStatement:
    claim = replace(claim, p_holm=p)
    if p <= SIGNIFICANCE or claim.verdict not in ("reproduced", "not reproduced"):
        return claim
    few = statements * 2.0 ** (1 - claim.clips) > SIGNIFICANCE
    reason = (
        f"too few units: {claim.clips}, and among {statements} printed statements a difference needs "
        f"{count_needed(statements)}"
        if few
        else f"not significant among {statements} printed statements: p {format_p_value(p)} after Holm"
    )
    return replace(claim, verdict="cannot tell", why="; ".join(filter(None, (reason, claim.why))))


def _paired_p(more: Errors, less: Errors, units: Iterable[str]) -> float | None:
    """p of the paired differences by sign flips; None with too few units for an interval."""
    difference = np.array([more[unit] - less[unit] for unit in units])
    return sign_flip_p(difference) if len(difference) >= MIN_UNITS else None


def claim_published_value(
    text: str,
    published: float,
    errors: Errors,
    *,
    comparable: bool,
    why: str,
    unit: str = "deg",
    kind: StatementKind = "printed",
    reading: Reading = "",
) -> BenchmarkStatement:
    """Claim that the mean error is the published figure, within `TOLERANCE`; `why` says why it is not `comparable`.

    The means are compared directly, since figures from two motion libraries have no paired difference.
    """
    claim = BenchmarkStatement(
        *(text, f"{published:g} {unit}", "not measured", "not run", "no unit was measured"),
        unit=unit,
        kind=kind,
        reading=reading,
    )
    if not errors:
        return claim
    mean = sum(errors.values()) / len(errors)
    claim = replace(claim, measured=f"{mean:.2f} {unit}", clips=len(errors), value=mean, why=why)
    if not comparable:
        return replace(claim, verdict="not comparable")
    off = mean / published - 1.0
    change = format_change_percent(100.0 * off)
    if abs(off) <= TOLERANCE:
        return replace(claim, verdict="reproduced", why=f"{change}, within {TOLERANCE:.0%}")
    return replace(claim, verdict="not reproduced", why=f"{change}, beyond {TOLERANCE:.0%}; {why}".removesuffix("; "))
