"""How wide the shear band of a biaxial run is (needs numpy): python band_width.py FOLDER STEP ELEMENT

FOLDER is what `femdem-flow export` wrote, ELEMENT the length of an element. The rule, on the initial mesh: of the shear
strains at the Gauss points those at least 0.15 away from the free sides; a straight line by least squares through what lies
above the mean of the least and the greatest of them; the strain over the distance from that line, as the mean of the Gauss points
in strips half an element wide. What is printed is the full width of that profile at half of its height over the strain
outside of the band, which is the mean of its lowest quarter, and beside it the area of the profile over its height.
"""

import base64
import re
import sys
from pathlib import Path

import numpy as np

EDGE = 0.15  # distance from the free sides that is left out
STRIP = 0.25  # half the width of a strip, in elements


def arrays(file):
    """The arrays of a VTU file by name."""
    found = {}
    for attributes, content in re.findall(r"<DataArray ([^>]*)>([^<]*)</DataArray>", file.read_text()):
        name = re.search(r'Name="([^"]*)"', attributes)[1]
        kind = {"Float64": "<f8", "Int64": "<i8", "UInt8": "u1"}[re.search(r'type="([^"]*)"', attributes)[1]]
        width = re.search(r'NumberOfComponents="(\d+)"', attributes)
        values = np.frombuffer(base64.b64decode(content[12:]), kind)  # behind the length, 8 bytes
        found[name] = values.reshape(-1, int(width[1])) if width else values
    return found


def profile(x, strain, half_strip):
    """Distances from the band, the mean strain there, and the inclination of the band in degrees."""
    width = round(x[:, 0].max() + x[:, 0].min(), 6)
    inside = (x[:, 0] > EDGE) & (x[:, 0] < width - EDGE)
    x, strain = x[inside], strain[inside]
    weight = np.clip(strain - 0.5 * (strain.min() + strain.max()), 0, None)
    centre = weight @ x / weight.sum()
    _, directions = np.linalg.eigh((x - centre).T @ ((x - centre) * weight[:, None]))
    along, across = directions[:, 1] * np.sign(directions[0, 1]), directions[:, 0]
    distance = (x - centre) @ across
    at = np.arange(-0.9, 0.9, half_strip)
    strips = [strain[np.abs(distance - d) < half_strip] for d in at]
    kept = [len(strip) >= 3 for strip in strips]
    means = np.array([strip.mean() for strip, keep in zip(strips, kept) if keep])
    return at[kept], means, np.degrees(np.arctan2(along[1], along[0]))


def crossing(at, means, peak, level, step):
    """Where the profile falls through `level`, from its peak on in one direction."""
    k = peak
    while means[k + step] > level:
        k += step
    share = (means[k] - level) / (means[k] - means[k + step])
    return at[k] + share * (at[k + step] - at[k])


folder, step, element = Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
points = arrays(folder / f"points-{step:04}.vtu")
at, means, angle = profile(points["Points"][:, :2], points["shear_strain"], STRIP * element)
outside = np.sort(means)[: len(means) // 4].mean()
peak = int(np.argmax(means))
half = 0.5 * (outside + means[peak])
width = crossing(at, means, peak, half, 1) - crossing(at, means, peak, half, -1)
area = np.trapezoid(np.clip(means - outside, 0, None), at) / (means[peak] - outside)
print(f"{folder.name}@{step}: width {width:.3f} ({width / element:.1f} elements), area over height {area:.3f}; "
      f"{100 * means[peak]:.1f} % inside, {100 * outside:.1f} % outside; {angle:.0f}° to the horizontal")
