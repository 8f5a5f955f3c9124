"""Values → the colours of a map's cells, and the ink that can be read on them."""

from dataclasses import dataclass

import numpy as np
from plotly.colors import hex_to_rgb, sequential

from simcore.report.quantities import Quantity

SEQUENTIAL = tuple(zip(np.linspace(0, 1, len(sequential.Viridis)).tolist(), sequential.Viridis,
                       strict=True))
"""Share of the scale and colour; viridis is even in lightness for any kind of sight."""

MARGIN = (
    (0.0, "#b35806"), (0.25, "#f1a340"), (0.5, "#f7f7f7"), (0.75, "#998ec3"), (1.0, "#542788")
)
"""Orange where the body fell, purple where margin is left (ColorBrewer PuOr)."""

DARK_INK, LIGHT_INK = "#000000", "#ffffff"


@dataclass(frozen=True)
class Shades:
    """Colours by share of a scale from `low` to `high`, in shown units."""

    stops: tuple[tuple[float, str], ...]
    low: float
    high: float

    def colour(self, value: float) -> str:
        """Return the colour of a value as #rrggbb; beyond its ends the scale goes on evenly."""
        return "#" + "".join(f"{round(each):02x}" for each in self._rgb(value))

    def ink(self, value: float) -> str:
        """Return black or white, whichever has more contrast on the colour of a value."""
        share = self._rgb(value) / 255
        linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
        luminance = linear @ [0.2126, 0.7152, 0.0722]  # WCAG 2.1, relative luminance
        return DARK_INK if luminance > 0.179 else LIGHT_INK

    @property
    def for_plotly(self) -> dict:
        """What a heat map of plotly takes."""
        return {"colorscale": self.stops, "zmin": self.low, "zmax": self.high}

    def _rgb(self, value: float) -> np.ndarray:
        share = (value - self.low) / (self.high - self.low or 1.0)
        shares = [share for share, _ in self.stops]
        channels = np.array([hex_to_rgb(colour) for _, colour in self.stops]).T
        return np.array([np.interp(share, shares, channel) for channel in channels])


def shades_of(name: str, quantity: Quantity, values) -> Shades:
    """Return the shades of a metric whose SI values (…) are to be shown; some may be NaN."""
    if name == "fall_margin":
        return Shades(MARGIN, -1.0, 1.0)
    low, high = (quantity.factor * float(bound(values)) for bound in (np.nanmin, np.nanmax))
    return Shades(SEQUENTIAL, min(low, 0.0), high)
