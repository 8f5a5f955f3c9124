"""simcore: which patient lift design drops the patient, and which presses too hard.

>>> import simcore
>>> ds = simcore.open("results/lift_angle")                       # every figure, on the axes
>>> ds.fall_margin.sel(body="male_172_70").to_series()
>>> run = simcore.open("results/lift_angle", body="male_172_70", support_angle_deg=7)
>>> run.skin_pressure.max("skin_vertex").plot()                   # over time [Pa]
"""

__all__ = ["open"]


def open(path, **place):
    """Open what a sweep or `simcore simulate` wrote, as an xarray Dataset in memory.

    Parameters
    ----------
    path : str or Path
        A study's folder (`results/NAME`) or its `dataset.nc`: the figures of all candidates, on
        the study's axes. Or the file of one run.
    **place
        Axis = value for every axis of several values: opens that candidate's run instead, its
        frames over time.

    Returns
    -------
    xarray.Dataset
        SI units and radians, each variable with `units` and `long_name`; docs/dataset.md has the
        list. A candidate that failed has a `status` other than "ok", and its figures are NaN.

    Raises
    ------
    simcore.errors.DesignError
        No such file, of another version, or no such place; the message says what is accepted.

    Examples
    --------
    >>> ds = simcore.open("results/lift_angle")
    >>> held = (ds.status == "ok") & (ds.fell == 0)
    >>> ds.peak_pressure.where(held).min("support_angle_deg")     # [Pa], by body
    """
    from simcore.dataset import open_results  # slow to import, and needed only here

    return open_results(path, **place)
