"""Scenarios and sweeps: their files read into frozen records, which are checked once."""
