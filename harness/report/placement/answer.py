"""The answer of a placement study in sentences, and as the headline of its page."""

from harness.report.kit.text import truncate
from harness.report.placement.question_answer import advice_sentences, disputed_choice, short_answers
from harness.report.placement.study_answer import smallest_sufficient_set, study_sentences
from harness.results.findings import PlacementFindings, StationNames

MOST_LETTERS = 134
"""Most letters of a headline: two lines of a page that is 1400 pixels wide, in a wide font."""


def placement_sentence(findings: PlacementFindings) -> str:
    """The whole answer: of a question what is advised, of a study in a file the best sets of the asked sizes."""
    return " ".join(_sentences(findings))


def headline_sentence(findings: PlacementFindings) -> str:
    """The first sentences of the answer, as many as fit; where the first is too long, the answer in fewer words."""
    sentences = _sentences(findings)
    if findings.advice is None or disputed_choice(findings) is None:
        forms = [" ".join(sentences[:count]) for count in range(len(sentences), 0, -1)]
    else:
        forms = [" ".join(sentences[:2])]  # the set and the disagreement belong together
    forms += short_answers(findings, findings.advice) if findings.advice else []
    return next((form for form in forms if len(form) <= MOST_LETTERS), truncate(forms[-1], MOST_LETTERS))


def _sentences(findings: PlacementFindings) -> list[str]:
    return advice_sentences(findings, findings.advice) if findings.advice else study_sentences(findings)


def recommended_set(findings: PlacementFindings) -> StationNames:
    """The set that the headline recommends; () where nothing was measured."""
    if findings.advice:
        choice = disputed_choice(findings)
        return choice.shared.stations if choice and choice.shared else findings.advice.best.stations
    best = smallest_sufficient_set(findings)
    return best.stations if best else ()
