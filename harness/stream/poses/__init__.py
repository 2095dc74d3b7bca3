"""Timed poses that another program wrote: their record and the reader of their files."""
