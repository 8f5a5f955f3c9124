"""The sheet of a sling lift: its net, how it hangs, and what moves it."""

from simcore.sheet.bed import BedContact
from simcore.sheet.contact import ContactForce, PlaneContact
from simcore.sheet.explicit import ExplicitSolver
from simcore.sheet.hanging import STILL_BAR, BarState, Straps, build_straps, check_reach
from simcore.sheet.liu import LiuSolver
from simcore.sheet.net import Net, build_net
from simcore.sheet.solver import Reaction, Sheet, SheetSolver, SheetState, lay_flat, make_sheet

__all__ = [
    "STILL_BAR",
    "BarState",
    "BedContact",
    "ContactForce",
    "ExplicitSolver",
    "LiuSolver",
    "Net",
    "PlaneContact",
    "Reaction",
    "Sheet",
    "SheetSolver",
    "SheetState",
    "Straps",
    "build_net",
    "build_straps",
    "check_reach",
    "lay_flat",
    "make_sheet",
]
