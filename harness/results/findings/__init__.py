"""Findings of studies: what a paper, a placement study and a trust study leave on disk."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.results.findings.benchmark_statement import BenchmarkStatement as BenchmarkStatement
    from harness.results.findings.benchmark_statement import Reading as Reading
    from harness.results.findings.benchmark_statement import StatementKind as StatementKind
    from harness.results.findings.benchmark_statement import Verdict as Verdict
    from harness.results.findings.paper_findings import BarChart as BarChart
    from harness.results.findings.paper_findings import FindingsTable as FindingsTable
    from harness.results.findings.paper_findings import LineChart as LineChart
    from harness.results.findings.paper_findings import PaperExperiment as PaperExperiment
    from harness.results.findings.paper_findings import PaperFindings as PaperFindings
    from harness.results.findings.paper_findings import read_findings as read_findings
    from harness.results.findings.paper_findings import write_findings as write_findings
    from harness.results.findings.placement_findings import MODES as MODES
    from harness.results.findings.placement_findings import BestSet as BestSet
    from harness.results.findings.placement_findings import CandidatePlace as CandidatePlace
    from harness.results.findings.placement_findings import ChangedOrder as ChangedOrder
    from harness.results.findings.placement_findings import MarginalContribution as MarginalContribution
    from harness.results.findings.placement_findings import PlacementCondition as PlacementCondition
    from harness.results.findings.placement_findings import PlacementFindings as PlacementFindings
    from harness.results.findings.placement_findings import PlacementMode as PlacementMode
    from harness.results.findings.placement_findings import PlacementSearch as PlacementSearch
    from harness.results.findings.placement_findings import RankAgreement as RankAgreement
    from harness.results.findings.placement_findings import RankedSet as RankedSet
    from harness.results.findings.placement_findings import Ranking as Ranking
    from harness.results.findings.placement_findings import SearchStep as SearchStep
    from harness.results.findings.placement_findings import StationNames as StationNames
    from harness.results.findings.placement_findings import StationSetResult as StationSetResult
    from harness.results.findings.placement_findings import StatisticalPower as StatisticalPower
    from harness.results.findings.placement_findings import read_placement as read_placement
    from harness.results.findings.placement_findings import write_placement as write_placement
    from harness.results.findings.trust_findings import Equivalence as Equivalence
    from harness.results.findings.trust_findings import EquivalenceVerdict as EquivalenceVerdict
    from harness.results.findings.trust_findings import ErrorDistance as ErrorDistance
    from harness.results.findings.trust_findings import PairAgreement as PairAgreement
    from harness.results.findings.trust_findings import PairVerdict as PairVerdict
    from harness.results.findings.trust_findings import RankCorrelation as RankCorrelation
    from harness.results.findings.trust_findings import SideDifference as SideDifference
    from harness.results.findings.trust_findings import StationHealth as StationHealth
    from harness.results.findings.trust_findings import StreamHealth as StreamHealth
    from harness.results.findings.trust_findings import TrustCapture as TrustCapture
    from harness.results.findings.trust_findings import TrustFindings as TrustFindings
else:
    __getattr__, __dir__ = lazy_names(__name__)
