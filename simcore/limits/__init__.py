"""Limits that results are compared with, as data with sources, and margins (docs/limits.md)."""
