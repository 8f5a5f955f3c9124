"""The table of docs/validation.md, and its plots: `python -m simcore.validation.document`."""

from collections.abc import Sequence
from pathlib import Path

from simcore.validation.figures import write_plot
from simcore.validation.registry import run
from simcore.validation.table import Outcome, Row, rounded

DOCS = Path("docs")


def as_markdown(rows: Sequence[Row]) -> str:
    """Return the rows as a Markdown table."""
    lines = ["| row | what | value | accepted | source | result |", 6 * "|---" + "|"]
    lines += [
        f"| `{row.key}` | {row.what} | {rounded(row.value)} | {row.interval} | {row.source} | "
        f"{'pass' if row.passed else '**fail**'} |"
        for row in rows
    ]
    return "\n".join(lines) + "\n"


def replace_table(text: str, table: str) -> str:
    """Return the text of a document with its one table replaced."""
    lines = text.splitlines(keepends=True)
    at = [i for i, line in enumerate(lines) if line.startswith("|")]
    return "".join([*lines[: at[0]], table, *lines[at[-1] + 1 :]])


def write_document(outcomes: Sequence[Outcome], folder: Path) -> None:
    """Renew the table of validation.md, and images/validation_*.svg, in a folder."""
    for outcome in outcomes:
        for plot in outcome.plots:
            write_plot(plot, folder / "images")
    document = folder / "validation.md"
    table = as_markdown([row for outcome in outcomes for row in outcome.rows])
    document.write_text(
        replace_table(document.read_text(encoding="utf-8"), table), encoding="utf-8"
    )


if __name__ == "__main__":
    write_document(list(run()), DOCS)
