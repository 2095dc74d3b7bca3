"""Findings of studies: what a paper, a placement study and a trust study leave on disk."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.results.findings.benchmark_statement import BenchmarkStatement, Reading, StatementKind, Verdict
    from harness.results.findings.paper_findings import (
        BarChart,
        FindingsTable,
        LineChart,
        PaperExperiment,
        PaperFindings,
        read_findings,
        write_findings,
    )
    from harness.results.findings.placement_findings import (
        MODES,
        BestSet,
        CandidatePlace,
        ChangedOrder,
        MarginalContribution,
        PlacementCondition,
        PlacementFindings,
        PlacementMode,
        PlacementSearch,
        RankAgreement,
        RankedSet,
        Ranking,
        SearchStep,
        StationNames,
        StationSetResult,
        StatisticalPower,
        read_placement,
        write_placement,
    )
    from harness.results.findings.trust_findings import (
        Equivalence,
        EquivalenceVerdict,
        ErrorDistance,
        PairAgreement,
        PairVerdict,
        RankCorrelation,
        SideDifference,
        StationHealth,
        StreamHealth,
        TrustCapture,
        TrustFindings,
    )
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "MODES",
    "BarChart",
    "BenchmarkStatement",
    "BestSet",
    "CandidatePlace",
    "ChangedOrder",
    "Equivalence",
    "EquivalenceVerdict",
    "ErrorDistance",
    "FindingsTable",
    "LineChart",
    "MarginalContribution",
    "PairAgreement",
    "PairVerdict",
    "PaperExperiment",
    "PaperFindings",
    "PlacementCondition",
    "PlacementFindings",
    "PlacementMode",
    "PlacementSearch",
    "RankAgreement",
    "RankCorrelation",
    "RankedSet",
    "Ranking",
    "Reading",
    "SearchStep",
    "SideDifference",
    "StatementKind",
    "StationHealth",
    "StationNames",
    "StationSetResult",
    "StatisticalPower",
    "StreamHealth",
    "TrustCapture",
    "TrustFindings",
    "Verdict",
    "read_findings",
    "read_placement",
    "write_findings",
    "write_placement",
]
