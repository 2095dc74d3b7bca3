"""Motion capture: files, libraries and sources of clips."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.mocap.clip_file import CLIP_FORMATS, read_clip
    from harness.mocap.fetch import fetch_cmu
    from harness.mocap.file_inspection import inspect_file
    from harness.mocap.library import LibraryFolders, MotionLibrary, absolute_folders, ignored_paths_note
    from harness.mocap.read.amc import read_amc
    from harness.mocap.read.c3d import MarkerClip, read_c3d
    from harness.mocap.shared_motion import SharedMotion, find_shared_motion
    from harness.mocap.sources import (
        MOCAP_VARIABLE,
        POPULATION_SIZE,
        MotionSource,
        SyntheticSource,
        find_library_folders,
        folders_of_environment,
        open_motion_source,
        read_skeletons,
    )
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "CLIP_FORMATS",
    "MOCAP_VARIABLE",
    "POPULATION_SIZE",
    "LibraryFolders",
    "MarkerClip",
    "MotionLibrary",
    "MotionSource",
    "SharedMotion",
    "SyntheticSource",
    "absolute_folders",
    "fetch_cmu",
    "find_library_folders",
    "find_shared_motion",
    "folders_of_environment",
    "ignored_paths_note",
    "inspect_file",
    "open_motion_source",
    "read_amc",
    "read_c3d",
    "read_clip",
    "read_skeletons",
]
