"""The unit that a key carries at the end of its name: one table for YAML, tables and NetCDF."""

UNITS_OF_SUFFIX = {
    "_deg": "degree",
    "_m": "m",
    "_s": "s",
    "_kg": "kg",
    "_n": "N",
    "_hz": "Hz",
    "_years": "year",
    "_m_per_s": "m s-1",
    "_n_per_m": "N m-1",
    "_pa": "Pa",
    "_pa_per_m": "Pa m-1",
    "_kg_per_m2": "kg m-2",
    "_ns_per_m": "N s m-1",
    "_nm_per_rad": "N m rad-1",
    "_nms_per_rad": "N m s rad-1",
}
"""CF unit by the ending of a design key."""


def units_of_key(path: str) -> str:
    """Return the CF unit of a dotted path: that of its last part that names one, or "1".

    In `posture.angles_deg.hip.flexion` it is a part on the way that names the unit.
    """
    for part in reversed(path.split(".")):
        if unit_suffix(part):
            return UNITS_OF_SUFFIX[unit_suffix(part)]
    return "1"


def unit_suffix(key: str) -> str:
    """Return the ending of a key that names its unit, empty where there is none."""
    return max((suffix for suffix in UNITS_OF_SUFFIX if key.endswith(suffix)), key=len, default="")
