"""The picture of docs/restarts.md, from exports of the runs: python restarts.py FOLDER (needs matplotlib).

FOLDER holds the folders that `femdem-flow export` wrote for `cycles` and its branches.
"""

import csv
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

RUNS = [
    ("cycles", "black", "the specimen"),
    ("cycles-unload", "tab:blue", "unloaded and reloaded"),
    ("cycles-small", "tab:orange", "small cycles"),
    ("cycles-extension", "tab:green", "extension and back"),
]


def curve(run):
    with open(os.path.join(sys.argv[1], run, "curves.csv")) as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    column = lambda name: np.array([float(row[name]) for row in rows])
    # A branch has its parent's steps in front of its own: they are drawn once.
    own = column("step") >= (0 if run == "cycles" else 10)
    return [values[own] for values in (-column("load_shortening") / 2 * 100, -column("fy_top"), column("volume_strain") * 100)]


figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2), constrained_layout=True)
for run, colour, label in RUNS:
    strain, stress, volume = curve(run)
    left.plot(strain, stress, ".-", color=colour, label=label)
    right.plot(strain, volume, ".-", color=colour)
    if run == "cycles":
        left.plot(strain[10], stress[10], "o", color="tab:red", ms=9, mfc="none", zorder=9, label="cycles@10")
left.set(xlabel="axial strain (%)", ylabel="σ₁/σ₂")
left.legend(frameon=False)
right.set(xlabel="axial strain (%)", ylabel="volume strain (%), dilation positive")
figure.savefig(os.path.join(os.path.dirname(os.path.abspath(__file__)), "restarts.png"), dpi=110)
