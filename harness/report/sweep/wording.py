"""A sweep in words: the effect of each key and of two together, the best method, progress, groups of failures."""

from collections.abc import Mapping
from dataclasses import replace

from harness.compare import GATED_METRICS, ClipValues, Sampling, count_clips, count_units, rank_methods, split_by_lag
from harness.core.number_format import format_number, format_p_value
from harness.report.kit.ranking import LAG_NOTE, describe_ranking, name_lag
from harness.report.kit.text import last_line, list_first
from harness.report.sweep.data import SweepData, VariedKey, unit_of
from harness.report.sweep.effects import Interaction, KeyEffect, key_effects, key_interactions
from harness.results import PRIMARY_METRIC

_MOST_NAMED = 4
"""Most values of a key that a sentence names."""


def sweep_sentence(sweep: SweepData, *, reasons: bool = True) -> str:
    """The result: which value of each key is best, and which keys interact; without varied keys the best method.

    The headline of a page leaves out the reasons why values cannot be told apart; `effect_reason` has them.
    """
    sentences = []
    for performers in dict.fromkeys(sweep.performers):
        effects = key_effects(sweep, performers)
        of_kind = [effect_sentence(effect, reasons=reasons) for effect in effects]
        of_kind += [f"{_dependence(each)}." for each in key_interactions(sweep, performers) if _is_told(each)]
        if of_kind:
            counted = count_units({unit for effect in effects for unit in effect.units})
            sentences.append(f"{' '.join(of_kind)} Compared on {counted}{f' ({performers})' * bool(performers)}.")
    return " ".join(sentences) or best_sentence(sweep) or progress_sentence(sweep)


def effect_sentence(effect: KeyEffect, *, reasons: bool = True) -> str:
    """Which value of a key is best, by how much, and which values cannot be told apart."""
    name, labels, lowest = effect.key.name, effect.key.labels, effect.key.labels[effect.lowest]
    means = effect.errors.mean(axis=0)
    worse = sorted((n for n, contrast in effect.contrasts.items() if contrast.is_told), key=lambda n: float(means[n]))
    tied = [labels[n] for n in effect.contrasts if n not in worse]
    if not worse:
        why = f" ({effect_reason(effect)})" if reasons else ""
        return f"{name}: {list_first([lowest, *tied], _MOST_NAMED)} cannot be told apart{why}."
    best = (
        f"{list_first([lowest, *tied], _MOST_NAMED)} are best and cannot be told apart" if tied else f"{lowest} is best"
    )
    at = worse[-1] if tied else worse[0]
    return f"{name}: {best}; {labels[at]} errs {replace(effect.contrasts[at].difference, signed=False)} more."


def effect_reason(effect: KeyEffect) -> str:
    """Why no value of a key is told to be best; "" where one is."""
    if any(contrast.is_told for contrast in effect.contrasts.values()):
        return ""
    labels, largest = effect.key.labels, max(effect.contrasts, key=lambda n: effect.contrasts[n].difference.value)
    return f"lowest at {labels[effect.lowest]}; {labels[largest]}: {effect.contrasts[largest].why}"


def interaction_sentence(interaction: Interaction) -> str:
    """Whether the effect of one key depends on the other, with the difference of differences."""
    value, at = interaction.largest
    contrast = interaction.contrasts[value, at]
    key, by = interaction.key, interaction.by
    effects = interaction.effects(value)
    more = (
        f"{key.labels[value]} instead of {key.labels[0]} changes the error by {effects[0]} at {by.labels[0]} and by "
        f"{effects[at]} at {by.labels[at]}, a difference of differences of {contrast.difference}"
    )
    if contrast.is_told:
        p, units = format_p_value(contrast.p), count_units(interaction.units)
        return f"{_dependence(interaction)}: {more} (p {p}, corrected; {units})."
    if all(each.verdict == "same" for each in interaction.contrasts.values()):
        return f"The effect of {key.name} is the same at every {by.name}, within the margin: {more}."
    return f"Whether the effect of {key.name} depends on {by.name} cannot be told ({contrast.why}): {more}."


def _dependence(interaction: Interaction) -> str:
    return f"The effect of {interaction.key.name} depends on {interaction.by.name}"


def _is_told(interaction: Interaction) -> bool:
    return interaction.contrasts[interaction.largest].is_told


def progress_sentence(sweep: SweepData) -> str:
    """Number of cells that are finished, failed and not yet run."""
    remaining = sweep.planned - len(sweep) - len(sweep.failures)
    parts = [f"{len(sweep):,} of {sweep.planned:,} cells finished"]
    parts += [f"{len(sweep.failures):,} failed"] if sweep.failures else []
    parts += [f"{remaining:,} still to run"] if remaining > 0 else []
    return f"{', '.join(parts)}."


def best_sentence(sweep: SweepData) -> str:
    """The best series, separately for known and new performers and for each number of later frames."""
    groups: dict[str, dict[str, ClipValues]] = {}
    for n, (name, performer) in enumerate(zip(sweep.series, sweep.performers, strict=True)):
        values = sweep.clip_values(sweep.select(series=n), GATED_METRICS)
        if values[PRIMARY_METRIC]:
            groups.setdefault(performer, {})[name] = values
    if not groups:
        return "Nothing was measured." if len(sweep) else ""
    lags = dict(zip(sweep.series, sweep.lags, strict=True))
    parts = [part for group in groups.values() for part in split_by_lag(group, lags).items()]
    sentences = [_best_of(values, frames, sweep.sampling) for frames, values in sorted(parts, key=lambda part: part[0])]
    return " ".join([*sentences, *([LAG_NOTE] if len({frames for frames, _ in parts}) > 1 else [])])


def _best_of(values: Mapping[str, ClipValues], frames: int, sampling: Sampling) -> str:
    ranking = rank_methods(values, PRIMARY_METRIC, sampling)
    if ranking is None:
        return f"{list_first(list(values))} share no measured clip, so they are not ranked."
    where = count_clips(ranking.clips, sampling) + (f", with {name_lag(frames)}" if frames else "")
    return describe_ranking(ranking, where, _format_error)


def group_failures(sweep: SweepData) -> dict[str, list[str]]:
    """Last line of the traceback -> cells that failed with it, the most frequent first."""
    cells_of: dict[str, list[str]] = {}
    for cell, text in sweep.failures.items():
        cells_of.setdefault(last_line(text), []).append(cell)
    return dict(sorted(cells_of.items(), key=lambda item: -len(item[1])))


def list_values(key: VariedKey) -> str:
    """The first values of a key, and the number of the others."""
    return list_first(key.labels, 8)


def _format_error(value: float) -> str:
    return f"{format_number(value, unit_of(PRIMARY_METRIC))} {unit_of(PRIMARY_METRIC)}"
