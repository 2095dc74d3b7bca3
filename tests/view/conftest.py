"""Fixtures of pages and pictures, shared with the tests of reports."""

from tests.report.conftest import browser, renders

__all__ = ["browser", "renders"]
