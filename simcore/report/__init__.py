"""Dataset → one HTML file with verdicts, charts, pictures and provenance."""

from simcore.report.html import build_report

__all__ = ["build_report"]
