"""Methods that turn frames into poses: the contract, the registry, the examples that they learn from."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.reconstruct.contract import DatabaseMethod, Method, Reconstructor, Session
    from harness.reconstruct.database.motion_database import MotionDatabase
    from harness.reconstruct.features.example_features import ExampleFeatures, FeatureWeights
    from harness.reconstruct.features.local_experts import HISTORY_AXES
    from harness.reconstruct.features.moment_table import cells_for
    from harness.reconstruct.features.virtual_trackers import VirtualTrackers
    from harness.reconstruct.methods.dynamic_map import DynamicMap
    from harness.reconstruct.methods.expert_map import FEATURES, ExpertMap
    from harness.reconstruct.methods.ik import Ik
    from harness.reconstruct.methods.local_pca import LocalPca
    from harness.reconstruct.methods.mean_pose import FittedMeanPose, MeanPose
    from harness.reconstruct.registry import (
        defining_module,
        is_built_in,
        list_methods,
        make_method,
        method_origin,
        without_options,
    )
    from harness.reconstruct.source_files import (
        CACHE_FOLDER,
        SourceFiles,
        declared_environment,
        find_source_files,
        foreign_folders,
        is_below,
        is_own,
        library_folders,
        source_hash,
    )
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "CACHE_FOLDER",
    "FEATURES",
    "HISTORY_AXES",
    "DatabaseMethod",
    "DynamicMap",
    "ExampleFeatures",
    "ExpertMap",
    "FeatureWeights",
    "FittedMeanPose",
    "Ik",
    "LocalPca",
    "MeanPose",
    "Method",
    "MotionDatabase",
    "Reconstructor",
    "Session",
    "SourceFiles",
    "VirtualTrackers",
    "cells_for",
    "declared_environment",
    "defining_module",
    "find_source_files",
    "foreign_folders",
    "is_below",
    "is_built_in",
    "is_own",
    "library_folders",
    "list_methods",
    "make_method",
    "method_origin",
    "source_hash",
    "without_options",
]
