"""Readers of Acclaim files, skeletons (ASF) and motions (AMC), in one namespace."""

from harness.mocap.read.amc import read_amc, read_amc_clip
from harness.mocap.read.asf import AsfFile, read_asf, read_asf_file

__all__ = ["AsfFile", "read_amc", "read_amc_clip", "read_asf", "read_asf_file"]
