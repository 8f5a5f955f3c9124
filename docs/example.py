"""What a notebook does with a study: `python docs/example.py results/lift_angle`."""

import sys

import numpy as np

import simcore

study = sys.argv[1] if len(sys.argv) > 1 else "results/lift_angle"
ds = simcore.open(study)
print(ds.title)

# Every figure is an array over the axes of the study, in SI units; what failed is NaN.
held = (ds.status == "ok") & (ds.fell == 0)
axes = [name for name in ds.candidate.dims if name != "body"]
print("held, of each body:", held.sum(axes).to_series().to_dict())

# The design whose worst body keeps the largest margin to a fall, and what it presses.
worst = ds.fall_margin.where(held).min("body", skipna=False)
if worst.notnull().any():
    best = worst.isel(worst.argmax(...)).coords
    design = {name: best[name].item() for name in axes}
    peak = ds.peak_pressure.sel(design)
    print("best:", design, {str(each.body.item()): f"{each.item() / 1e3:.1f} kPa" for each in peak})

# The table, for pandas or a spreadsheet.
print(ds[["fall_margin", "peak_pressure"]].to_dataframe().round(3).to_string())

# One run: its frames over time, here the highest pressure on the skin and the lift's force.
place = {name: ds[name].values[-1].item() for name in ds.candidate.dims}
run = simcore.open(study, **place)
moved = run.sel(time=slice(0, None))
peak = moved.skin_pressure.max("skin_vertex")
print(place, "is pressed most after", f"{peak.time.values[int(np.argmax(peak.values))]:.2f} s:",
      f"{peak.max().item() / 1e3:.1f} kPa")
print("mean upward force:", f"{moved.support_force.sel(xyz='z').mean().item():.0f} N")
