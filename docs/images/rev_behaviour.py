"""The pictures of docs/rev-behaviour.md (needs matplotlib): python rev_behaviour.py FOLDER

FOLDER holds what `femdem-flow rev test workflows/examples/rev-NAME.yaml` prints, as NAME-SEED.csv: `unloading` and
`cycles` with seeds of the material as wished, `simple-shear` with seed 1.
"""

import csv
import glob
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

folder = sys.argv[1]
here = os.path.dirname(os.path.abspath(__file__))
INK, RED, BLUE = "black", "#b5482e", "#2c6e9b"


def read(file):
    with open(file) as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    return {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}


def runs(name):
    return [read(file) for file in sorted(glob.glob(os.path.join(folder, f"{name}-*.csv")))]


def save(figure, name):
    figure.savefig(os.path.join(here, name), dpi=110)


# Unloading from 0.2, 0.5 and 1 %.
figure, (upper, lower) = plt.subplots(2, 1, figsize=(7, 6.5), sharex=True, height_ratios=[1.6, 1], constrained_layout=True)
for run, color, width in zip(runs("unloading"), [INK, RED, BLUE], [1.3, 0.8, 0.8]):
    upper.plot(-100 * run["eyy"], run["syy"] / run["sxx"], color=color, lw=width)
    lower.plot(-100 * run["eyy"], 100 * run["volume_strain"], color=color, lw=width)
upper.axhline(1, color="grey", lw=0.5)
upper.set(ylabel="σ₁/σ₂", title="load – unload – reload, constant lateral stress, one REV of 400 grains")
lower.set(xlabel="axial strain (%), compression positive", ylabel="volume strain (%)\ndilation positive")
save(figure, "rev-unloading.png")

# Cycles.
figure, axes = plt.subplots(2, 3, figsize=(11, 6.5), sharey="row", constrained_layout=True)
for run in runs("cycles")[:1]:
    strain, ratio = -100 * run["eyy"], (run["syy"] - run["sxx"]) / (run["syy"] + run["sxx"])
    for (stage, size), (top, bottom) in zip([(2, 0.5), (4, 1), (6, 2)], axes.T):
        for k, color in enumerate([BLUE, RED, INK]):
            at = np.flatnonzero(run["stage"] == stage)
            part = np.array_split(at, 3)[k]
            part = np.concatenate([[part[0] - 1], part])
            top.plot(strain[part], ratio[part], color=color, lw=1, label=f"cycle {k + 1}")
            bottom.plot(strain[part], 100 * run["volume_strain"][part], color=color, lw=1)
        top.axhline(0, color="grey", lw=0.5)
        top.set(title=f"±{size} %")
        bottom.set(xlabel="axial strain (%)")
axes[0, 0].set(ylabel="(σ₁ − σ₂)/(σ₁ + σ₂)\ncompression positive")
axes[1, 0].set(ylabel="volume strain (%)\ndilation positive")
axes[0, 0].legend(frameon=False)
save(figure, "rev-cycles.png")

# Simple shear.
figure, (upper, lower) = plt.subplots(2, 1, figsize=(7, 5.5), sharex=True, constrained_layout=True)
for run in runs("simple-shear"):
    upper.plot(run["exy"], run["sxy"] / -run["syy"], color=INK, lw=0.8)
    lower.plot(run["exy"], run["void_ratio"], color=INK, lw=0.8)
upper.set(ylabel="σ_xy/|σ_yy|", title="simple shear at constant normal stress, one REV of 400 grains")
lower.set(xlabel="γ", ylabel="void ratio")
save(figure, "rev-shear.png")

# The figures of the page.
print("cycles: seed, range, cycle: work per volume, secant stiffness, peaks in compression and extension, volume at the end")
for seed, run in enumerate(runs("cycles"), 1):
    strain, stress = -run["eyy"], -(run["syy"] - run["sxx"])
    ratio = (run["syy"] - run["sxx"]) / (run["syy"] + run["sxx"])
    for stage, size in [(2, 0.5), (4, 1), (6, 2)]:
        at = np.flatnonzero(run["stage"] == stage)
        for k, part in enumerate(np.array_split(at, 3)):
            part = np.concatenate([[part[0] - 1], part])
            work = np.sum(0.5 * (stress[part][1:] + stress[part][:-1]) * np.diff(strain[part]))
            span = stress[part].max() - stress[part].min()
            secant = span / (strain[part].max() - strain[part].min())
            print(seed, size, k + 1, f"{work:.4f} {secant:.0f} {ratio[part].max():.3f} {ratio[part].min():.3f}",
                  f"{100 * run['volume_strain'][part[-1]]:.2f} % z {run['coordination'][part[-1]]:.2f}")
print("unloading: seed, from: initial slope, slope at half the way")
for seed, run in enumerate(runs("unloading"), 1):
    for stage in [2, 4, 6]:
        at = np.flatnonzero(run["stage"] == stage)
        at = np.concatenate([[at[0] - 1], at])
        slope = np.diff(run["syy"][at]) / np.diff(run["eyy"][at])
        volume = 100 * run["volume_strain"][at]
        print(seed, stage, f"{slope[0]:.0f} {slope[len(slope) // 2]:.0f} volume {volume[0]:.3f} → {volume[-1]:.3f} %",
              f"σ1/σ0 {-run['syy'][at[0]]:.2f} → {-run['syy'][at[-1]]:.2f}")
