"""Measure, keep the result, and print it: `python -m benchmarks [PART …] [--document]`.

No part means all. `--document` renews docs/performance.md from the history.
"""

import sys

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from benchmarks.document import history_of, origin, write_document
from benchmarks.parts import PARTS
from simcore.bench import append, new_entry

console = Console(soft_wrap=True, width=None if sys.stdout.isatty() else 170)
"""As wide as the widest part where nothing bounds it."""


def main(arguments: list[str]) -> int:
    """Measure the parts named and print one table; return the exit code."""
    wanted = [each for each in arguments if each != "--document"] or list(PARTS)
    unknown = [each for each in wanted if each not in PARTS]
    if unknown:
        console.print(f"benchmarks: no part {', '.join(unknown)}; accepted: {', '.join(PARTS)}")
        return 2
    entries = {}
    for name in wanted:
        part = PARTS[name]
        if reason := part.missing():
            console.print(reason, highlight=False)
            continue
        with console.status(part.what, spinner="line"):
            entries[name] = new_entry(part.measure)
        append(history_of(name), entries[name])
    if entries:
        console.print(_one_table(entries))
        for name, entry in entries.items():
            console.print(f"{name}: {origin(entry)}", end="", highlight=False)
    if "--document" in arguments:
        write_document(list(entries))
    return 0


def _one_table(entries: dict[str, dict]) -> Table:
    """Return the tables of all parts under each other, each with its header."""
    tables = {name: PARTS[name].table(entry) for name, entry in entries.items()}
    table = Table(*[""] * max(len(each[0]) for each in tables.values()), show_header=False)
    for header, *rows in tables.values():
        table.add_row(*(f"[bold]{escape(cell)}" for cell in header))
        for row in rows:
            table.add_row(*map(escape, row), end_section=row is rows[-1])
    return table


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
