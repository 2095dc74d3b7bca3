"""What the units of a placement study can show, in sentences."""

from harness.core.number_format import NOT_MEASURED, Interval, count_noun
from harness.results.findings import StatisticalPower


def power_sentences(power: StatisticalPower) -> list[str]:
    """What the units of a study can show, and how long more of them take."""
    units, sets = count_noun(power.clips, "unit"), count_noun(power.sets, "set")
    took = f" The study takes {format_duration(power.duration_s)}." if power.duration_s is not None else ""
    if power.sets < 2:
        return [f"One set is measured on {units}: nothing is compared.{took}"]
    if power.clips < power.least_clips:
        more = f" ({format_duration(power.least_duration_s)})" if power.least_duration_s is not None else ""
        first = f"{units} cannot show any difference between {sets}, {power.least_clips} might{more}.{took}"
    elif power.shown is None:
        first = f"{units} can show a difference between {sets}; how large it must be is unknown.{took}"
    else:
        first = (
            f"{units} can show a difference of {Interval(power.shown, unit=power.unit)} between two of {sets} "
            f"(power 80 %, p corrected for {power.sets - 1:,} comparisons).{took}"
        )
    if power.needed_clips is None or power.wanted is None or power.needed_clips <= power.clips:
        return [first]
    more = f", about {format_duration(power.needed_duration_s)}" if power.needed_duration_s is not None else ""
    measured = "The spread is that of these" if power.cell_s is None else "Spread and time are those of the first"
    second = (
        f"A difference of {Interval(power.wanted, unit=power.unit)}, a tenth of the error, would need about "
        f"{power.needed_clips:,} units{more}. {measured} {power.pilot_sets} sets."
    )
    return [first, second]


def format_duration(seconds: float | None) -> str:
    """A rough duration: "40 s", "7 min", "3.5 h", "12 days"."""
    if seconds is None:
        return NOT_MEASURED
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    if seconds < 5400.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.1f} h" if seconds < 172800.0 else f"{seconds / 86400.0:,.0f} days"
