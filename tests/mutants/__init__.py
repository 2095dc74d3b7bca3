"""Mutation testing: `python -m tests.mutants` changes the package in small ways and counts the tests that notice.

A development tool, not part of `harness`. Source: DeMillo, Lipton and Sayward 1978, "Hints on test data selection".
"""
