"""Placement of stations: candidate places on the body are evaluated in sets and ranked, with statistical ties."""
