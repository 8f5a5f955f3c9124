"""Runs → the formats of other programs: animated glTF, CSV tables (docs/export.md)."""
