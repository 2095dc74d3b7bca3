"""Methods that turn frames into poses: the contract, the registry, the examples that they learn from."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.reconstruct.contract import DatabaseMethod as DatabaseMethod
    from harness.reconstruct.contract import Method as Method
    from harness.reconstruct.contract import Reconstructor as Reconstructor
    from harness.reconstruct.contract import Session as Session
    from harness.reconstruct.database.motion_database import MotionDatabase as MotionDatabase
    from harness.reconstruct.features.example_features import ExampleFeatures as ExampleFeatures
    from harness.reconstruct.features.example_features import FeatureWeights as FeatureWeights
    from harness.reconstruct.features.local_experts import HISTORY_AXES as HISTORY_AXES
    from harness.reconstruct.features.moment_table import cells_for as cells_for
    from harness.reconstruct.features.virtual_trackers import VirtualTrackers as VirtualTrackers
    from harness.reconstruct.methods.dynamic_map import DynamicMap as DynamicMap
    from harness.reconstruct.methods.expert_map import FEATURES as FEATURES
    from harness.reconstruct.methods.expert_map import ExpertMap as ExpertMap
    from harness.reconstruct.methods.ik import Ik as Ik
    from harness.reconstruct.methods.local_pca import LocalPca as LocalPca
    from harness.reconstruct.methods.mean_pose import FittedMeanPose as FittedMeanPose
    from harness.reconstruct.methods.mean_pose import MeanPose as MeanPose
    from harness.reconstruct.registry import defining_module as defining_module
    from harness.reconstruct.registry import is_built_in as is_built_in
    from harness.reconstruct.registry import list_methods as list_methods
    from harness.reconstruct.registry import make_method as make_method
    from harness.reconstruct.registry import method_origin as method_origin
    from harness.reconstruct.registry import without_options as without_options
    from harness.reconstruct.source_files import CACHE_FOLDER as CACHE_FOLDER
    from harness.reconstruct.source_files import SourceFiles as SourceFiles
    from harness.reconstruct.source_files import declared_environment as declared_environment
    from harness.reconstruct.source_files import find_source_files as find_source_files
    from harness.reconstruct.source_files import foreign_folders as foreign_folders
    from harness.reconstruct.source_files import is_below as is_below
    from harness.reconstruct.source_files import is_own as is_own
    from harness.reconstruct.source_files import library_folders as library_folders
    from harness.reconstruct.source_files import source_hash as source_hash
else:
    __getattr__, __dir__ = lazy_names(__name__)
