"""Sheets by themselves, for the tests of the sheet room."""

from simcore.config.sling_lift import Fabric, HangingDesign, RectangleOutline, SheetDesign
from simcore.sheet import PlaneContact

# A device has straps; a sheet by itself need not.
NO_STRAPS = HangingDesign.model_construct(
    attachments=(), strap_stiffness_n_per_m=3e4, strap_damping_ns_per_m=30.0
)


def fabric(stiffness_per_width=2e4, density=0.3):
    return Fabric(
        kind="fabric", stiffness_per_width_n_per_m=stiffness_per_width,
        areal_density_kg_per_m2=density,
    )


def untouched(sheet):
    return PlaneContact.empty(len(sheet.net.mass))


def rectangular(length, width, material, count):
    outline = RectangleOutline(shape="rectangle", length_m=length, width_m=width)
    return SheetDesign(outline=outline, material=material, vertex_count=count, pelvis_x_m=0.0)
