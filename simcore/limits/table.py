"""The table of limits, limits.csv: each value with its source and how sure it is.

Values are kept as their sources print them and are read in SI units.
"""

import csv
from dataclasses import dataclass
from functools import cache
from pathlib import Path

TABLE = Path(__file__).with_name("limits.csv")

MMHG = 133.322387415  # [Pa]: 13 595.1 kg/m³ · 9.80665 m/s² · 1 mm
SI = {
    "kPa": ("Pa", 1e3),
    "mmHg": ("Pa", MMHG),
    "mmHg h": ("Pa s", 3600 * MMHG),
    "min": ("s", 60.0),
    "h": ("s", 3600.0),
    "1/min": ("1/s", 1 / 60),
    "s": ("s", 1.0),
    "m/s": ("m/s", 1.0),
    "N m": ("N m", 1.0),
}
"""Printed unit → SI unit, and its size in that."""

CONFIDENCE = ("read", "transcribed", "from memory, to be confirmed", "derived")
"""Read in the source, its abstract or a paper that cites it; taken from third-party code; recalled;
calculated from what was read."""


@dataclass(frozen=True)
class Limit:
    """One row of the table.

    Attributes
    ----------
    quantity, condition : str
        What is limited, and where or of whom; together they name the row.
    value, units
        In SI.
    printed : str
        Value and unit as in the source.
    source, confidence, note : str
        Where it comes from, one of `CONFIDENCE`, and what it can and cannot say.
    """

    quantity: str
    condition: str
    value: float
    units: str
    printed: str
    source: str
    confidence: str
    note: str

    @property
    def verified(self) -> bool:
        """Whether the value was read, and neither recalled nor taken from a copy."""
        return self.confidence == "read"


@cache
def limits() -> dict[tuple[str, str], Limit]:
    """Return all rows by quantity and condition."""
    rows = {}
    with TABLE.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            units, size = SI[row["unit"]]
            limit = Limit(
                quantity=row["quantity"], condition=row["condition"],
                value=size * float(row["value"]), units=units,
                printed=f"{row['value']} {row['unit']}",
                source=row["source"], confidence=row["confidence"], note=row["note"],
            )
            rows[limit.quantity, limit.condition] = limit
    return rows


def limits_of(quantity: str) -> tuple[Limit, ...]:
    """Return the rows of one quantity, in the order of the table."""
    return tuple(limit for limit in limits().values() if limit.quantity == quantity)


def as_markdown() -> str:
    """Return the table as docs/limits.md has it."""
    lines = ["| quantity | of | value | source | confidence | what it says |", 6 * "|---" + "|"]
    lines += [
        f"| `{limit.quantity}` | {limit.condition} | {limit.printed} | {limit.source} |"
        f" {limit.confidence} | {limit.note} |"
        for limit in limits().values()
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(as_markdown(), end="")
