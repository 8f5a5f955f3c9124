"""Assistive devices: surfaces and the motion that carries them."""

from simcore.device.build import build_surface
from simcore.device.motion import DeviceState, Motion
from simcore.device.surface import Surface

__all__ = [
    "DeviceState",
    "Motion",
    "Surface",
    "build_surface",
]
