"""How figures are shown: what a designer reads, with the unit; SI stays in the dataset."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from simcore.config.units import UNITS_OF_SUFFIX, unit_suffix

NOT_KNOWN = "–"
"""Shown in place of a figure that does not exist."""


@dataclass(frozen=True)
class Quantity:
    """How one metric is shown: shown value = factor · SI value, in `unit`."""

    title: str
    unit: str
    factor: float
    digits: int

    @property
    def label(self) -> str:
        """Title with unit, as on an axis."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    def text(self, value: float) -> str:
        """Return an SI value as shown, with its unit."""
        if not np.isfinite(value):
            return NOT_KNOWN
        number = f"{self.factor * value:,.{self.digits}f}"
        number = number.replace("-", "−")
        return f"{number}{'' if self.unit == '°' else ' '}{self.unit}".rstrip()


QUANTITIES = {
    "fall_margin": Quantity("Fall margin", "", 1.0, 2),
    "topple_margin": Quantity("Topple margin", "°", float(np.degrees(1)), 1),
    "fall_time": Quantity("Time of fall", "s", 1.0, 2),
    "slide_distance": Quantity("Slide on the support", "mm", 1e3, 0),
    "peak_pressure": Quantity("Peak pressure", "kPa", 1e-3, 1),
    "lying_peak_pressure": Quantity("Peak pressure before the start", "kPa", 1e-3, 1),
    "region_peak_pressure": Quantity("Peak pressure", "kPa", 1e-3, 1),
    "peak_shear": Quantity("Peak shear", "kPa", 1e-3, 1),
    "region_peak_shear": Quantity("Peak shear", "kPa", 1e-3, 1),
    "contact_area": Quantity("Contact area", "cm²", 1e4, 0),
    "region_contact_area": Quantity("Contact area", "cm²", 1e4, 0),
    "region_load": Quantity("Load", "N", 1.0, 0),
    "slip_share": Quantity("Load that slips", "%", 1e2, 1),
    "rest_slip_share": Quantity("Load that slips at rest", "%", 1e2, 1),
    "support_force_ratio": Quantity("Support force over weight", "", 1.0, 3),
    "support_force_spread": Quantity("Unsteadiness of the support force", "", 1.0, 3),
    "peak_edge_distance": Quantity("Peak from the sheet's edge", "cm", 1e2, 0),
    "peak_strap_force": Quantity("Greatest strap tension", "N", 1.0, 0),
    "max_penetration": Quantity("Deepest penetration", "mm", 1e3, 1),
    "joint_excursion": Quantity("Joint excursion", "°", float(np.degrees(1)), 0),
    "joint_range_margin": Quantity("Margin of a joint's range", "", 1.0, 2),
    "neck_moment": Quantity("Torque of the neck", "N·m", 1.0, 1),
    "lifting_speed": Quantity("Lifting speed", "m/s", 1.0, 2),
    "energy_residual": Quantity("Energy unexplained", "%", 1e2, 2),
    "simulated_time": Quantity("Simulated time", "s", 1.0, 1),
    "cpu_time": Quantity("Processor time", "s", 1.0, 1),
}
"""Metrics in shown units."""

SYMBOLS = {"degree": "°", "1": "", "N m-1": "N/m", "N s m-1": "N·s/m", "m s-1": "m/s",
           "Pa m-1": "Pa/m", "kg m-2": "kg/m²", "N m rad-1": "N·m/rad",
           "N m s rad-1": "N·m·s/rad", "year": "years"}
"""Units of design keys as shown, where they differ from the CF spelling."""

GROUPINGS = ("surface", "angles", "placement", "attachments")
"""Keys of a design that only hold others together: left out where a path is put in words."""

POWERS_FROM, POWERS_BELOW = 1e6, 1e-4
"""Numbers so large, or smaller, are shown with a power of ten: 4·10⁶."""

NAMED = ("body", "device")
"""Axes whose values are names that need no title."""

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Axis:
    """How one axis of a study is shown.

    Attributes
    ----------
    name : str
        Dimension of the dataset; also what `--set` accepts.
    title, unit : str
        As shown; no unit for a categorical axis.
    values : tuple
        As in the dataset.
    numeric : bool
    """

    name: str
    title: str
    unit: str
    values: tuple
    numeric: bool

    @property
    def label(self) -> str:
        """Title with unit, as on a chart's axis."""
        title = self.title[:1].upper() + self.title[1:]
        return f"{title} [{self.unit}]" if self.unit else title

    @property
    def geometric(self) -> bool:
        """Whether the values span so much that a chart needs a logarithmic axis."""
        return self.numeric and min(self.values) > 0 and max(self.values) >= 10 * min(self.values)

    @property
    def shown(self) -> tuple:
        """The values in shown units: numbers, or texts of a categorical axis."""
        return tuple(self._number(value) if self.numeric else str(value) for value in self.values)

    @property
    def ticks(self) -> list[str]:
        """The values as texts without unit, for a chart that has the unit on its axis."""
        return [number_text(value) if self.numeric else value for value in self.shown]

    def text(self, value: object) -> str:
        """Return one value as shown, with its unit."""
        if not self.numeric:
            return str(value)
        gap = "" if self.unit == "°" else " "
        return f"{number_text(self._number(value))}{gap}{self.unit}".rstrip()

    def _number(self, value: object) -> float:
        return float(f"{float(value) * (1e3 if self.unit == 'mm' else 1.0):.10g}")


def axes_of(ds: xr.Dataset) -> tuple[Axis, ...]:
    """Return the axes of a study, `body` first."""
    return tuple(_axis(ds, str(name)) for name in ds["candidate"].dims)


def number_text(value: float) -> str:
    """Return a number as it is read: six digits, thousands apart, 2·10⁶ for 2e+06."""
    if value and not POWERS_BELOW <= abs(value) < POWERS_FROM:
        digits, power = f"{value:.5e}".split("e")
        digits = digits.rstrip("0").removesuffix(".")
        return f"{digits}·10{str(int(power)).translate(SUPERSCRIPTS)}".removeprefix("1·").replace(
            "-", "−"
        )
    return f"{value:,.6g}".replace("-", "−")


def path_title(path: tuple[str, ...]) -> str:
    """Return a path within a design in words: positions count from 1, groupings are left out."""
    words = [str(int(key) + 1) if key.isdigit() else key_title(key) for key in path]
    kept = [word for word in words[:-1] if word not in GROUPINGS]
    return " ".join([*kept, words[-1]])


def key_title(key: str) -> str:
    """Return a design key in words, without its unit."""
    return key.removesuffix(unit_suffix(key)).replace("_", " ")


def path_value(path: tuple[str, ...], value: object) -> str:
    """Return a design value with the unit that its key, or the nearest key above it, carries."""
    if value is None:
        return "none given"
    if isinstance(value, bool | str):
        return str(value)
    unit = next(filter(None, map(_unit, reversed(path))), "")
    numbers = value if isinstance(value, list) else [value]
    if unit == "m" and max(map(abs, numbers)) < 1:
        unit, numbers = "mm", [1e3 * number for number in numbers]
    text = ", ".join(map(number_text, numbers))
    text = f"({text})" if isinstance(value, list) else text
    return f"{text}{'' if unit == '°' else ' '}{unit}".rstrip()


def place_text(axes: tuple[Axis, ...], coordinates: dict) -> str:
    """Return coordinates in one line, such as "male_172_70, sling_short, support angle 7°"."""
    return ", ".join(
        str(coordinates[axis.name])
        if axis.name in NAMED
        else f"{axis.title} {axis.text(coordinates[axis.name])}"
        for axis in axes
        if axis.name in coordinates
    )


def coordinates_at(ds: xr.Dataset, index: tuple[int, ...]) -> dict:
    """Return axis name → value (plain Python) of the candidate at an index of the grid."""
    return {
        str(name): ds[name].values[i].item() if hasattr(ds[name].values[i], "item")
        else ds[name].values[i]
        for name, i in zip(ds["candidate"].dims, index, strict=True)
    }


def _axis(ds: xr.Dataset, name: str) -> Axis:
    values = tuple(ds[name].values.tolist())
    numeric = all(isinstance(value, int | float) and not isinstance(value, bool)
                  for value in values)
    if name == "body":
        return Axis(name, "body", "", values, False)
    unit = ds[name].attrs.get("units", "1") if numeric else ""
    unit = SYMBOLS.get(unit, unit)
    if unit == "m" and max(abs(value) for value in values) < 1:
        unit = "mm"
    # An axis is named by its whole path where the last part would not be unique.
    path = tuple(name.split("."))
    return Axis(name, path_title(path[1:] or path), unit, values, numeric)


def _unit(key: str) -> str:
    unit = UNITS_OF_SUFFIX.get(unit_suffix(key), "")
    return SYMBOLS.get(unit, unit)
