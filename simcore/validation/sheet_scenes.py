"""Sheets by themselves: what the checks of sheet and friction are built of."""

import numpy as np

from simcore.config.sling_lift import Fabric, HangingDesign, RectangleOutline, SheetDesign
from simcore.sheet import Net, PlaneContact, Sheet, build_net, build_straps, lay_flat, make_sheet

# A device has straps; a sheet by itself need not.
NO_STRAPS = HangingDesign.model_construct(
    attachments=(), strap_stiffness_n_per_m=3e4, strap_damping_ns_per_m=30.0
)

FOUNDATION = 1.0e6
"""Stiffness per area of what a sheet is laid on [N/m³]."""

HEAVY = 10.0
"""Of a fabric of the usual stiffness that needs no added inertia [kg/m²] ..."""

SUBSTEP = 2.5e-4
"""... in explicit sub-steps of this length [s]."""


def fabric(stiffness_per_width: float = 2e4, density: float = 0.3) -> Fabric:
    """Return a fabric of E_w [N/m] and mass per area [kg/m²]."""
    return Fabric(
        kind="fabric", stiffness_per_width_n_per_m=stiffness_per_width,
        areal_density_kg_per_m2=density,
    )


def rectangular(length: float, width: float, material, count: int) -> SheetDesign:
    """Return a rectangle [m] of about `count` vertices, from x = 0 and centred on y = 0."""
    outline = RectangleOutline(shape="rectangle", length_m=length, width_m=width)
    return SheetDesign(outline=outline, material=material, vertex_count=count, pelvis_x_m=0.0)


def free_sheet(net: Net, pinned: np.ndarray | None = None) -> Sheet:
    """Return a sheet that hangs by nothing but its pinned vertices."""
    return make_sheet(net, build_straps(net, NO_STRAPS), pinned)


def heavy_square(count: int = 225) -> Sheet:
    """Return a free square of 0.3 m that needs no added inertia."""
    return free_sheet(build_net(rectangular(0.3, 0.3, fabric(density=HEAVY), count)))


def untouched(sheet: Sheet) -> PlaneContact:
    """Return the contact of a sheet that touches nothing."""
    return PlaneContact.empty(len(sheet.net.mass))


def plane(
    net: Net, normal=(0.0, 0.0, 1.0), offset: float = 0.0, friction: float = 0.0
) -> PlaneContact:
    """Return a plane under the whole sheet, with anchors where it lies when flat at the origin.

    Parameters
    ----------
    normal : (3,)
        World.
    offset : float
        [m]
    friction : float
        µ.
    """
    contact = PlaneContact.empty(len(net.mass))
    contact.active[:] = True
    contact.normal[:] = normal
    contact.offset[:] = offset
    contact.stiffness[:] = FOUNDATION * net.vertex_area
    contact.damping[:] = 2e3 * net.vertex_area
    contact.friction_coefficient = friction
    contact.tangential_stiffness[:] = contact.stiffness / 2
    contact.tangential_damping[:] = contact.damping / 2
    contact.anchor[:] = lay_flat(net, np.zeros(3)).position
    return contact
