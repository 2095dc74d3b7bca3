"""What the page of a trust study shows, and its text."""

from dataclasses import dataclass

from harness.results.trust_findings import TrustFindings


@dataclass(frozen=True)
class TrustReport:
    """The content of the page: the findings, and how they were made."""

    findings: TrustFindings
    command: str
    """The command that makes the page."""
