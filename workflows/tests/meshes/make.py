"""The mesh files of the tests and examples, written by Gmsh (pip install gmsh meshio; made with 4.15.2 and 5.3.5).

    python make.py

Each mesh but the large one is a plate of 2 × 1 with a slot in its lower edge, in two regions `soft` and `stiff`, with
the boundaries `left`, `right`, `top`, `bottom`, `slot`, a line `seam` inside, and the points `corner` and `tips`.
`expected.json` has what meshio reads from them.
"""

import json
import pathlib

import gmsh
import meshio

HERE = pathlib.Path(__file__).parent
EXAMPLES = HERE.parent.parent / "examples"


def plate(size=0.5, recombine=True, order=2, incomplete=True, groups=True):
    gmsh.clear()
    geo = gmsh.model.geo
    at = [(0, 0), (0.8, 0), (1, 0.3), (1.2, 0), (2, 0), (2, 1), (1, 1), (0, 1)]
    p = [geo.addPoint(x, y, 0, size) for x, y in at]
    line = lambda a, b: geo.addLine(p[a], p[b])
    bottom = [line(0, 1), line(3, 4)]
    slot = [line(1, 2), line(2, 3)]
    right, top = line(4, 5), [line(5, 6), line(6, 7)]
    left, seam = line(7, 0), line(2, 6)
    soft = geo.addPlaneSurface([geo.addCurveLoop([bottom[0], slot[0], seam, top[1], left])])
    # Against the clock: Gmsh then writes elements that have to be turned.
    stiff = geo.addPlaneSurface([-geo.addCurveLoop([slot[1], bottom[1], right, top[0], -seam])])
    if recombine:
        # Meshes of quadrangles alone divide every curve by an even number.
        for curve in bottom + slot + top + [right, left, seam]:
            geo.mesh.setTransfiniteCurve(curve, 3)
    geo.synchronize()
    if groups:
        add = gmsh.model.addPhysicalGroup
        for name, lines in [("bottom", bottom), ("slot", slot), ("right", [right]), ("top", top), ("left", [left]), ("seam", [seam])]:
            add(1, lines, name=name)
        add(2, [soft], name="soft")
        add(2, [stiff], name="stiff")
        add(2, [soft, stiff], name="whole plate")
        add(0, [p[0]], name="corner")
        add(0, [p[1], p[3]], name="tips")
        add(0, [p[5]])  # a group without a name
    option(recombine, order, incomplete)
    if recombine:
        for surface in (soft, stiff):
            gmsh.model.mesh.setRecombine(2, surface)
    gmsh.model.mesh.generate(2)


def option(recombine, order, incomplete):
    set_number = gmsh.option.setNumber
    set_number("Mesh.ElementOrder", order)
    set_number("Mesh.SecondOrderIncomplete", int(incomplete))
    # All quadrangles: without, some triangles are left over.
    set_number("Mesh.RecombinationAlgorithm", 2 if recombine else 1)
    set_number("Mesh.Algorithm", 8 if recombine else 6)


def write(name, version=4.1, binary=False, folder=HERE):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", int(binary))
    gmsh.write(str(folder / f"{name}.msh"))


def quarter_hole(folder, name, circumference=8, radius=7):
    """A quarter of a square of side 2 · 8 around a hole of radius 1, graded towards the hole, all quadrangles."""
    gmsh.clear()
    geo = gmsh.model.geo
    side, half = 8.0, 0.5**0.5
    centre = geo.addPoint(0, 0, 0)
    east, diagonal, north = geo.addPoint(1, 0, 0), geo.addPoint(half, half, 0), geo.addPoint(0, 1, 0)
    far = [geo.addPoint(x, y, 0) for x, y in [(side, 0), (side, side), (0, side)]]
    arcs = [geo.addCircleArc(east, centre, diagonal), geo.addCircleArc(diagonal, centre, north)]
    outer = [geo.addLine(far[0], far[1]), geo.addLine(far[1], far[2])]
    rays = [geo.addLine(a, b) for a, b in zip([east, diagonal, north], far)]
    for curve in arcs + outer:
        geo.mesh.setTransfiniteCurve(curve, circumference // 2 + 1)
    for curve in rays:
        geo.mesh.setTransfiniteCurve(curve, radius + 1, "Progression", 1.5)
    surfaces = []
    for k in range(2):
        loop = geo.addCurveLoop([rays[k], outer[k], -rays[k + 1], -arcs[k]])
        surfaces.append(geo.addPlaneSurface([loop]))
        geo.mesh.setTransfiniteSurface(surfaces[-1])
        geo.mesh.setRecombine(2, surfaces[-1])
    geo.synchronize()
    add = gmsh.model.addPhysicalGroup
    add(1, arcs, name="hole")
    add(1, [outer[0]], name="right")
    add(1, [outer[1]], name="top")
    add(1, [rays[0]], name="symmetry_x")
    add(1, [rays[2]], name="symmetry_y")
    add(2, surfaces, name="soil")
    option(True, 2, True)
    gmsh.model.mesh.generate(2)
    write(name, folder=folder)


def solid():
    gmsh.clear()
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMin", 1)
    option(False, 1, False)
    gmsh.model.mesh.generate(3)
    gmsh.option.setNumber("Mesh.MeshSizeMin", 0)


def summary(path):
    """What meshio makes of a file: counts and, by group, the sums of coordinates, which tell nodes apart."""
    mesh = meshio.read(path)
    names = {(int(tag), int(dim)): name for name, (tag, dim) in mesh.field_data.items()}
    cells = {}
    for block in mesh.cells:
        cells[block.type] = cells.get(block.type, 0) + len(block.data)
    groups = {}
    for block, tags in zip(mesh.cells, mesh.cell_data.get("gmsh:physical", [])):
        for nodes, tag in zip(block.data, tags):
            name = names.get((int(tag), block.dim))
            if name and block.dim == 1:
                group = groups.setdefault(name, {"sides": 0, "nodes": set()})
                group["sides"] += 1
                group["nodes"].update(int(n) for n in nodes)
    for group in groups.values():
        points = mesh.points[sorted(group.pop("nodes"))]
        group["nodes"], group["sum"] = len(points), [round(float(x), 9) for x in points.sum(axis=0)[:2]]
    return {"cells": cells, "groups": groups}


def main():
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 1)
    plate()
    for version in (2.2, 4.1):
        for binary in (False, True):
            write(f"plate-{str(version).replace('.', '')}-{'binary' if binary else 'ascii'}", version, binary)
    plate(incomplete=False)
    write("plate-q9")
    plate(order=1)
    write("plate-q4", 2.2)
    plate(recombine=False)
    write("plate-t6", binary=True)
    plate(recombine=False, order=1)
    write("refused-t3")
    plate(groups=False)
    write("refused-no-groups")
    plate()
    gmsh.model.mesh.partition(2)
    write("refused-partitioned")
    write("partitioned-22", 2.2)
    solid()
    write("refused-solid", binary=True)
    # Some quadrangles, the rest triangles.
    plate(size=0.35)
    gmsh.clear()
    plate(recombine=False, size=0.35)
    gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 0)
    gmsh.option.setNumber("Mesh.RecombineMinimumQuality", 0.7)
    gmsh.model.mesh.setOrder(1)
    gmsh.model.mesh.recombine()
    gmsh.model.mesh.setOrder(2)
    write("refused-mixed")
    quarter_hole(EXAMPLES, "gmsh-quarter-hole")
    gmsh.finalize()
    expected = {}
    for path in sorted([*HERE.glob("plate-*.msh"), EXAMPLES / "gmsh-quarter-hole.msh"]):
        expected[path.stem] = summary(path)
    (HERE / "expected.json").write_text(json.dumps(expected, indent=1, sort_keys=True) + "\n")


main()
