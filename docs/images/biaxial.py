"""The picture of the README, from `femdem-flow export biaxial`: python biaxial.py FOLDER (needs meshio, matplotlib)."""

import csv
import glob
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import meshio
import numpy as np
from matplotlib.collections import PolyCollection

folder = sys.argv[1]
with open(os.path.join(folder, "curves.csv")) as file:
    rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
strain = np.array([-float(row["load_shortening"]) / 2 for row in rows]) * 100
stress = np.array([-float(row["fy_top"]) for row in rows])
volume = np.array([float(row["volume_strain"]) for row in rows]) * 100

mesh = meshio.read(sorted(glob.glob(os.path.join(folder, "fields-*.vtu")))[-1])
cells = mesh.cells[0].data[:, [0, 4, 1, 5, 2, 6, 3, 7]]
points = (mesh.points + mesh.point_data["displacement"])[:, :2]
shear = mesh.cell_data["shear_strain"][0] * 100

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 5), width_ratios=[1, 1.6], constrained_layout=True)
map_ = PolyCollection(points[cells], array=shear, cmap="inferno", edgecolors="face", linewidths=0.3)
left.add_collection(map_)
left.set(aspect="equal", title=f"second strain invariant at {strain[-1]:.1f} %")
left.autoscale()
left.axis("off")
figure.colorbar(map_, ax=left, label="%", shrink=0.7)
right.plot(strain, stress, "o-", color="black", ms=3, label="axial stress / lateral stress")
right.set(xlabel="axial strain (%)", ylabel="σ₁/σ₂", ylim=(0.9, None))
twin = right.twinx()
twin.plot(strain, volume, "s--", color="tab:blue", ms=3)
twin.set_ylabel("volume strain (%), dilation positive", color="tab:blue")
figure.savefig(os.path.join(os.path.dirname(os.path.abspath(__file__)), "biaxial.png"), dpi=110)
