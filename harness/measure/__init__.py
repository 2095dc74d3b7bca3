"""What a stream shows of a device: its errors, its timing, its registration, and unit files."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.measure.angular_speed import coarse_offset as coarse_offset
    from harness.measure.angular_speed import identify_stations as identify_stations
    from harness.measure.episode_distributions import events_for_precision as events_for_precision
    from harness.measure.episodes import Episodes as Episodes
    from harness.measure.episodes import find_excursions as find_excursions
    from harness.measure.episodes import find_gaps as find_gaps
    from harness.measure.gauss_markov import NOISE_KEYS as NOISE_KEYS
    from harness.measure.gauss_markov import ErrorProcess as ErrorProcess
    from harness.measure.handeye import PosePairs as PosePairs
    from harness.measure.handeye import most_likely_hand_eye as most_likely_hand_eye
    from harness.measure.log_profile import measure_log_profile as measure_log_profile
    from harness.measure.noise_spectra import ErrorSpectrum as ErrorSpectrum
    from harness.measure.noise_spectra import measure_allan as measure_allan
    from harness.measure.noise_spectra import measure_spectrum as measure_spectrum
    from harness.measure.noise_spectra import pool_spectra as pool_spectra
    from harness.measure.pose_directions import same_directions as same_directions
    from harness.measure.pose_registration import register_poses as register_poses
    from harness.measure.pose_registration import require_stamps as require_stamps
    from harness.measure.pose_series import MeasuredPoses as MeasuredPoses
    from harness.measure.pose_series import TruthPoses as TruthPoses
    from harness.measure.pose_series import TruthSpline as TruthSpline
    from harness.measure.profile import Bar as Bar
    from harness.measure.profile import QualityClass as QualityClass
    from harness.measure.profile import StretchLength as StretchLength
    from harness.measure.profile import UnitProfile as UnitProfile
    from harness.measure.profile import measure_profile as measure_profile
    from harness.measure.registration import Registration as Registration
    from harness.measure.registration import StationResiduals as StationResiduals
    from harness.measure.rigid_pair import RigidPair as RigidPair
    from harness.measure.sampling import describe_sampling as describe_sampling
    from harness.measure.sampling import mean_period_s as mean_period_s
    from harness.measure.surveyed_points import SurveyComparison as SurveyComparison
    from harness.measure.surveyed_points import compare_with_survey as compare_with_survey
    from harness.measure.timing import TIMING_KEYS as TIMING_KEYS
    from harness.measure.uncertainty import UncertaintyBudget as UncertaintyBudget
    from harness.measure.unit_file import CUT_ADVICE as CUT_ADVICE
    from harness.measure.unit_file import UNIT_FILE as UNIT_FILE
    from harness.measure.unit_file import UnitFile as UnitFile
    from harness.measure.unit_file import read_unit_file as read_unit_file
    from harness.measure.unit_file import write_unit_file as write_unit_file
else:
    __getattr__, __dir__ = lazy_names(__name__)
