"""Assistive devices: surfaces and the motion that carries them."""

from simcore.device.motion import DeviceState, Motion
from simcore.device.rigid import RigidDevice, build_surface
from simcore.device.surface import Surface

__all__ = [
    "DeviceState",
    "Motion",
    "RigidDevice",
    "Surface",
    "build_surface",
]
