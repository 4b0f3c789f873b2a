"""The picture of docs/packings.md: python biaxial-statistics.py, with the rows of `cargo run --release -p solver-dem
--example statistics` in biaxial-statistics.csv beside it (needs matplotlib)."""

import csv
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

here = os.path.dirname(os.path.abspath(__file__))
curves = {}
with open(os.path.join(here, "biaxial-statistics.csv")) as file:
    for row in csv.DictReader(file):
        point = [float(row[key]) for key in ("axial_strain", "stress_ratio", "volume_strain")]
        curves.setdefault(row["case"], {}).setdefault(row["seed"], []).append(point)

colours = {"dense": "#0072b2", "cohesive": "#d55e00", "loose": "#009e73"}
# What an independent study found for such packings: peak, near 10 %, volume strain at 10 % (%).
bands = {
    "dense": ((1.4, 3.2, 2.6, 2.8), (1.9, 2.2), (3.7, 5.0)),
    "cohesive": ((0.8, 1.9, 3.9, 4.1), (2.1, 2.6), (6.0, 7.8)),
    "loose": ((8.0, 9.0, 2.1, 2.5), (2.0, 2.1), (0.1, 0.5)),
}

figure, (top, bottom) = plt.subplots(2, 1, figsize=(7, 7.5), sharex=True, constrained_layout=True)
for k, (case, runs) in enumerate(curves.items()):
    colour = colours[case]
    runs = [np.array(run) for run in runs.values()]
    for run in runs:
        top.plot(100 * run[:, 0], run[:, 1], color=colour, lw=0.4, alpha=0.45)
        bottom.plot(100 * run[:, 0], 100 * run[:, 2], color=colour, lw=0.4, alpha=0.45)
    mean = np.mean(runs, axis=0)
    top.plot(100 * mean[:, 0], mean[:, 1], color=colour, lw=2, label=f"{case}, mean of {len(runs)}")
    bottom.plot(100 * mean[:, 0], 100 * mean[:, 2], color=colour, lw=2)
    (left, right, low, high), late, volume = bands[case]
    top.add_patch(plt.Rectangle((left, low), right - left, high - low, fill=False, ec=colour, ls="--", lw=1))
    bar = {"color": colour, "lw": 2.5, "clip_on": False}
    top.plot([10.1 + 0.1 * k] * 2, late, **bar)
    bottom.plot([10.1 + 0.1 * k] * 2, volume, **bar)
top.set(ylabel="σ₁/σ₂", ylim=(1, None), xlim=(0, 10))
top.legend(frameon=False)
bottom.set(xlabel="axial strain (%)", ylabel="volume strain (%), dilation positive")
for axes in (top, bottom):
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig(os.path.join(here, "biaxial-statistics.png"), dpi=110)
