"""The mesh of gallery.yaml: a square block around a round gallery, 384 eight-node quadrangles, graded towards the wall.

python gallery.py   (pip install gmsh)
"""

import math

import gmsh

RADIUS, HALF, GROWTH = 1.0, 6.0, 1.2
SECTORS, AROUND, OUTWARDS = 8, 4, 12  # elements around in each sector, and along the radius

gmsh.initialize()
gmsh.option.setNumber("General.Verbosity", 0)
model, geo = gmsh.model, gmsh.model.geo
centre = geo.addPoint(0, 0, 0)
wall_points, side_points = [], []
for k in range(SECTORS):
    c, s = math.cos(k * math.pi / 4), math.sin(k * math.pi / 4)
    far = HALF / max(abs(c), abs(s))
    wall_points.append(geo.addPoint(RADIUS * c, RADIUS * s, 0))
    side_points.append(geo.addPoint(round(far * c, 9), round(far * s, 9), 0))
spokes = [geo.addLine(a, b) for a, b in zip(wall_points, side_points)]
walls, sides, sectors = [], [], []
for k in range(SECTORS):
    j = (k + 1) % SECTORS
    walls.append(geo.addCircleArc(wall_points[k], centre, wall_points[j]))
    sides.append(geo.addLine(side_points[k], side_points[j]))
    loop = geo.addCurveLoop([spokes[k], sides[k], -spokes[j], -walls[k]])
    sectors.append(geo.addPlaneSurface([loop]))
for curve in walls + sides:
    geo.mesh.setTransfiniteCurve(curve, AROUND + 1)
for curve in spokes:
    geo.mesh.setTransfiniteCurve(curve, OUTWARDS + 1, "Progression", GROWTH)
for sector in sectors:
    geo.mesh.setTransfiniteSurface(sector)
    geo.mesh.setRecombine(2, sector)
geo.synchronize()
for name, pair in {"right": (7, 0), "top": (1, 2), "left": (3, 4), "bottom": (5, 6)}.items():
    model.addPhysicalGroup(1, [sides[k] for k in pair], name=name)
for name, k in {"right_mid": 0, "left_mid": 4, "bottom_mid": 6}.items():
    model.addPhysicalGroup(0, [side_points[k]], name=name)
model.addPhysicalGroup(1, walls, name="wall")
model.addPhysicalGroup(2, sectors, name="ground")
gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
gmsh.option.setNumber("Mesh.ElementOrder", 2)
model.mesh.generate(2)
gmsh.write("gallery.msh")
