"""Pressure → colour: one scale for the skin, the sensor mat and their colour bars."""

import numpy as np
from plotly.colors import hex_to_rgb, sequential

UNLOADED_COLOUR = (0.78, 0.78, 0.78)
"""Where nothing presses: no hue that could be read as a pressure."""

PRESSURE_SHARE_MIN = 0.03
"""Pressures fade in up to this share of the scale, so that their edge is not jagged."""

SCALE_STEPS = np.array([1, 1.5, 2, 2.5, 3, 3.5, 4, 5, 6, 8, 10])
"""Leading digits that the end of a pressure scale may have."""

STOPS = np.concatenate([np.linspace(0, PRESSURE_SHARE_MIN, 4)[:-1],
                        np.linspace(PRESSURE_SHARE_MIN, 1, 24)])
"""Shares of the scale at which a colour bar is told its colour."""


def pressure_colours(pressure: np.ndarray, scale: float) -> np.ndarray:
    """Return sRGB colours (n, 3) of pressures (n,) [Pa] on a scale from 0 to `scale` [Pa]."""
    table = np.array([hex_to_rgb(colour) for colour in sequential.Viridis]) / 255
    share = np.clip(pressure / scale, 0, 1)
    steps = np.linspace(0, 1, len(table))
    mapped = np.column_stack([np.interp(share, steps, table[:, i]) for i in range(3)])
    loaded = np.clip(share / PRESSURE_SHARE_MIN, 0, 1)[:, None]
    return loaded * mapped + (1 - loaded) * np.array(UNLOADED_COLOUR)


def colour_stops() -> list[tuple[float, str]]:
    """Return share of the scale and colour, for a colour bar."""
    colours = np.round(255 * pressure_colours(STOPS, 1.0)).astype(int)
    return [(float(share), f"rgb({red},{green},{blue})")
            for share, (red, green, blue) in zip(STOPS, colours, strict=True)]


def scale_end(peak: float) -> float:
    """Return the round pressure that covers a peak [Pa]."""
    power = 10.0 ** np.floor(np.log10(max(peak, 1.0)))
    return float(power * SCALE_STEPS[np.searchsorted(SCALE_STEPS, peak / power)])
