"""What a stream shows of a device: its errors, its timing, its registration, and unit files."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.measure.angular_speed import coarse_offset, identify_stations
    from harness.measure.episode_distributions import events_for_precision
    from harness.measure.episodes import Episodes, find_excursions, find_gaps
    from harness.measure.gauss_markov import NOISE_KEYS, ErrorProcess
    from harness.measure.handeye import PosePairs, most_likely_hand_eye
    from harness.measure.log_profile import measure_log_profile
    from harness.measure.noise_spectra import ErrorSpectrum, measure_allan, measure_spectrum, pool_spectra
    from harness.measure.pose_directions import same_directions
    from harness.measure.pose_series import MeasuredPoses, TruthPoses, TruthSpline
    from harness.measure.profile import Bar, QualityClass, StretchLength, UnitProfile, measure_profile
    from harness.measure.registration import (
        Registration,
        StationResiduals,
        register_poses,
        require_stamps,
    )
    from harness.measure.rigid_pair import RigidPair
    from harness.measure.sampling import describe_sampling, mean_period_s
    from harness.measure.surveyed_points import SurveyComparison, compare_with_survey
    from harness.measure.timing import TIMING_KEYS
    from harness.measure.uncertainty import UncertaintyBudget
    from harness.measure.unit_file import CUT_ADVICE, UNIT_FILE, UnitFile, read_unit_file, write_unit_file
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "CUT_ADVICE",
    "NOISE_KEYS",
    "TIMING_KEYS",
    "UNIT_FILE",
    "Bar",
    "Episodes",
    "ErrorProcess",
    "ErrorSpectrum",
    "MeasuredPoses",
    "PosePairs",
    "QualityClass",
    "Registration",
    "RigidPair",
    "StationResiduals",
    "StretchLength",
    "SurveyComparison",
    "TruthPoses",
    "TruthSpline",
    "UncertaintyBudget",
    "UnitFile",
    "UnitProfile",
    "coarse_offset",
    "compare_with_survey",
    "describe_sampling",
    "events_for_precision",
    "find_excursions",
    "find_gaps",
    "identify_stations",
    "mean_period_s",
    "measure_allan",
    "measure_log_profile",
    "measure_profile",
    "measure_spectrum",
    "most_likely_hand_eye",
    "pool_spectra",
    "read_unit_file",
    "register_poses",
    "require_stamps",
    "same_directions",
    "write_unit_file",
]
