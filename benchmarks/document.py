"""The tables of docs/performance.md, and docs/images/growth.svg, from the history."""

from pathlib import Path

from benchmarks import growth
from benchmarks.parts import PARTS, Table
from simcore.bench import latest
from simcore.validation.figures import write_plot

ROOT = Path(__file__).parents[1]
HISTORY = ROOT / "benchmarks" / "history"
DOCS = ROOT / "docs"


def history_of(part: str, folder: Path = HISTORY) -> Path:
    """Return where the history of a part is kept."""
    return folder / f"{part}.jsonl"


def write_document(parts: list[str]) -> None:
    """Renew the tables of some parts in docs/performance.md from the last entry of each."""
    document = DOCS / "performance.md"
    text = document.read_text(encoding="utf-8")
    for part in parts:
        entry = latest(history_of(part))
        table = as_markdown(PARTS[part].table(entry))
        text = replace_block(text, part, f"{table}\n{origin(entry)}")
        if part == "growth":
            write_plot(growth.plot(entry), DOCS / "images")
    document.write_text(text, encoding="utf-8")


def as_markdown(table: Table) -> str:
    """Return a table as Markdown."""
    header, *rows = table
    lines = [header, ["---"] * len(header), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def origin(entry: dict) -> str:
    """Return where and with what an entry was measured, on one line."""
    machine = entry["machine"]
    return (
        f"{entry['time'][:10]}, commit {entry['commit']}, one of {machine['cores']} cores of "
        f"{machine['processor']}; calibration {entry['calibration']['kernel_ms']:.2f} ms.\n"
    )


def replace_block(text: str, name: str, block: str) -> str:
    """Return a text with what stands between "<!-- NAME -->" and "<!-- end -->" replaced.

    Raises
    ------
    ValueError
        There is no such place.
    """
    begin, end = f"<!-- {name} -->\n", "<!-- end -->"
    start = text.index(begin) + len(begin)
    return text[:start] + block + text[text.index(end, start) :]
