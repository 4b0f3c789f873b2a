//! Meshes from Gmsh. The files in `meshes` are written by Gmsh itself (`make.py`) in all flavours of its format;
//! `expected.json` is what meshio, which knows nothing of this program, reads from them.

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use common::Bench;
use serde_json::Value;
use workflows::input::Element;
use workflows::input::gmsh::{self, GmshError, Imported};

const FLAVOURS: [&str; 4] = [
    "plate-22-ascii",
    "plate-22-binary",
    "plate-41-ascii",
    "plate-41-binary",
];

fn path(name: &str) -> PathBuf {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    match name.starts_with("gmsh-") {
        true => root.join("examples").join(format!("{name}.msh")),
        false => root.join("tests/meshes").join(format!("{name}.msh")),
    }
}

fn bytes(name: &str) -> Vec<u8> {
    fs::read(path(name)).unwrap()
}

#[track_caller]
fn mesh(name: &str) -> Imported {
    gmsh::read(&bytes(name), "mesh.msh").unwrap_or_else(|errors| panic!("{name}: {errors}"))
}

#[track_caller]
fn refused(bytes: &[u8]) -> Vec<GmshError> {
    gmsh::read(bytes, "mesh.msh").expect_err("it is wrong").0
}

/// Sides and nodes of a group of lines, whether it became a boundary or nodes.
fn group(mesh: &Imported, name: &str) -> (Option<usize>, usize, [f64; 2]) {
    let element = mesh.element.plane().element();
    let built = mesh.mesh();
    let (sides, mut nodes) = match mesh.boundaries.get(name) {
        Some(facets) => {
            let of_facet = |&[e, side]: &[u32; 2]| {
                let nodes = built.element(e as usize);
                let local = element.facet_nodes(side as usize).iter();
                local.map(|&a| nodes[a]).collect::<Vec<_>>()
            };
            (
                Some(facets.len()),
                facets.iter().flat_map(of_facet).collect::<Vec<_>>(),
            )
        }
        None => (None, built.node_sets[name].clone()),
    };
    nodes.sort_unstable();
    nodes.dedup();
    let mut sum = [0.0; 2];
    for &node in &nodes {
        sum[0] += mesh.nodes[node][0];
        sum[1] += mesh.nodes[node][1];
    }
    (sides, nodes.len(), sum)
}

#[test]
fn what_is_read_is_what_meshio_reads() {
    let expected = fs::read_to_string(path("plate-q4").with_file_name("expected.json")).unwrap();
    let expected: BTreeMap<String, Value> = serde_json::from_str(&expected).unwrap();
    assert!(expected.len() >= 8);
    for (name, expected) in expected {
        let mesh = mesh(&name);
        let plane: u64 = ["quad", "quad8", "quad9", "triangle6"]
            .iter()
            .filter_map(|kind| expected["cells"][kind].as_u64())
            .sum();
        // Format 2.2 has each element once for each of its two groups, and meshio counts both.
        let twice = 1 + u64::from(name.starts_with("plate-22") || name == "plate-q4");
        assert_eq!(mesh.element_count() as u64 * twice, plane, "{name}");
        for (group_name, expected) in expected["groups"].as_object().unwrap() {
            let (sides, nodes, sum) = group(&mesh, group_name);
            let count = |key: &str| expected[key].as_u64().unwrap() as usize;
            assert_eq!(
                sides.is_none(),
                group_name == "seam",
                "{name}: {group_name}"
            );
            assert_eq!(
                sides.unwrap_or(count("sides")),
                count("sides"),
                "{name}: {group_name}"
            );
            assert_eq!(nodes, count("nodes"), "{name}: {group_name}");
            for i in 0..2 {
                let exact = expected["sum"][i].as_f64().unwrap();
                assert!(
                    (sum[i] - exact).abs() < 1e-8,
                    "{name}: {group_name}: {sum:?}"
                );
            }
        }
    }
}

#[test]
fn all_flavours_of_one_mesh_are_one_mesh() {
    let first = mesh(FLAVOURS[0]);
    assert_eq!(first.element, Element::Q8);
    assert_eq!(
        first.node_sets.keys().collect::<Vec<_>>(),
        ["corner", "point_12", "seam", "tips"]
    );
    assert_eq!(
        first.groups.keys().collect::<Vec<_>>(),
        ["soft", "stiff", "whole plate"]
    );
    let both: Vec<u32> = (0..first.element_count() as u32).collect();
    assert_eq!(first.groups["whole plate"], both);
    assert_eq!(
        first.groups["soft"].len() + first.groups["stiff"].len(),
        both.len()
    );
    for name in &FLAVOURS[1..] {
        // As text, coordinates have 16 digits, one too few for the last bit.
        let mut other = mesh(name);
        for (x, exact) in other
            .nodes
            .iter_mut()
            .flatten()
            .zip(first.nodes.iter().flatten())
        {
            assert!((*x - exact).abs() < 1e-15, "{name}");
            *x = *exact;
        }
        assert_eq!(other, first, "{name}");
    }
    // One surface is drawn clockwise, so that its elements had to be turned; a sound mesh has none that is.
    let built = first.mesh();
    let element = first.element.plane().element();
    assert_eq!(built.check(element.as_ref()), vec![]);
    assert_eq!(built.check_conformity(element.as_ref()), vec![]);
    let outside = built
        .sides(element.as_ref())
        .values()
        .filter(|users| users.len() == 1)
        .count();
    let named: usize = first.boundaries.values().map(Vec::len).sum();
    assert_eq!(outside, named, "every open side is in exactly one boundary");
}

#[test]
fn a_nine_node_mesh_loses_its_middle_nodes_and_nothing_else() {
    let (eight, nine) = (mesh(FLAVOURS[2]), mesh("plate-q9"));
    assert_eq!(nine.element, Element::Q8);
    assert_eq!(
        (nine.nodes.len(), nine.element_count()),
        (eight.nodes.len(), eight.element_count())
    );
    assert_eq!(nine.boundaries, eight.boundaries);
    assert_eq!(mesh("plate-q4").element, Element::Q4);
    assert_eq!(mesh("plate-t6").element, Element::T6);
}

#[test]
fn what_cannot_be_computed_with_is_refused_in_words() {
    let of = |name: &str| {
        let errors = refused(&bytes(name));
        assert!(errors[0].help().is_some(), "{name}");
        errors[0].to_string()
    };
    assert!(of("refused-t3").contains("a three-node triangle, which locks"));
    assert!(of("refused-mixed").contains("mixes kinds of elements"));
    assert_eq!(of("refused-partitioned"), "the mesh is cut into partitions");
    // Format 2.2 only marks the elements with their partition; the mesh is whole.
    let (whole, marked) = (mesh(FLAVOURS[0]), mesh("partitioned-22"));
    assert_eq!(marked.groups["soft"], whole.groups["soft"]);
    assert_eq!(
        marked.boundaries["slot"].len(),
        whole.boundaries["slot"].len()
    );
    assert!(
        of("refused-solid").contains("a plane mesh is needed"),
        "{}",
        of("refused-solid")
    );
    // Without groups there is a mesh, and nothing to hold it by.
    assert!(mesh("refused-no-groups").boundaries.is_empty());
    assert_eq!(refused(b"name: biaxial\n"), [GmshError::NotGmsh]);
    assert_eq!(refused(b""), [GmshError::NotGmsh]);
    let old = refused(b"$MeshFormat\n4 0 8\n$EndMeshFormat\n");
    assert!(old[0].to_string().contains("format 4;"), "{}", old[0]);
}

/// A file of format 2.2 with these nodes and lines of elements.
fn file(nodes: &[[f64; 2]], elements: &[&str]) -> Vec<u8> {
    let mut text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n1 1 \"edge\"\n2 2 \"soil\"\n0 3 \"pin\"\n$EndPhysicalNames\n".to_owned();
    text += &format!("$Nodes\n{}\n", nodes.len());
    for (number, [x, y]) in nodes.iter().enumerate() {
        text += &format!("{} {x} {y} 0\n", 10 * number + 10);
    }
    text += &format!("$EndNodes\n$Elements\n{}\n", elements.len());
    for (number, element) in elements.iter().enumerate() {
        text += &format!("{} {element}\n", number + 100);
    }
    text += "$EndElements\n";
    text.into_bytes()
}

const SQUARE: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [1.0, 0.0],
    [1.0, 1.0],
    [0.0, 1.0],
    [2.0, 0.0],
    [2.0, 1.0],
];

#[test]
fn a_bad_mesh_is_refused_with_its_element_by_the_number_of_the_file() {
    let two = [
        "3 2 2 1 10 20 30 40",
        "3 2 2 1 20 50 60 30",
        "1 2 1 1 10 20",
    ];
    let sound = gmsh::read(&file(&SQUARE, &two), "f").unwrap();
    assert_eq!(
        (
            sound.element,
            sound.element_count(),
            sound.boundaries["edge"].len()
        ),
        (Element::Q4, 2, 1)
    );

    let said = |nodes: &[[f64; 2]], elements: &[&str]| {
        let errors = refused(&file(nodes, elements));
        errors
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join("\n")
    };
    let mut nodes = SQUARE;
    nodes[5] = [2.0, 0.0];
    nodes[4] = [1.5, 0.0];
    nodes[2] = [1.0, 0.0];
    nodes[1] = [1.0, 1.0];
    assert!(
        said(&nodes, &two).contains("(in the file: element 101"),
        "{}",
        said(&nodes, &two)
    );
    // No area.
    let flat = SQUARE.map(|[x, _]| [x, 0.0]);
    assert!(said(&flat, &two).contains("e0 has zero area (in the file: element 100)"));
    // A node twice in an element; an element twice over; a clash of sides.
    assert!(
        said(&SQUARE, &["3 2 2 1 10 20 20 40", two[1]])
            .contains("uses node 1 twice (in the file: element 100, node 20)")
    );
    // Not convex.
    let mut nodes = SQUARE;
    nodes[5] = [1.48, 0.48];
    assert!(
        said(&nodes, &two).contains("(in the file: element 101, node 60)"),
        "{}",
        said(&nodes, &two)
    );
    // Drawn twice: nodes of their own at the same places.
    let mut nodes = SQUARE.to_vec();
    nodes.extend([[1.0, 0.0], [1.0, 1.0]]);
    let apart = ["3 2 2 1 10 20 30 40", "3 2 2 1 70 50 60 80"];
    assert!(
        said(&nodes, &apart).contains("at the same place"),
        "{}",
        said(&nodes, &apart)
    );
    // A node that hangs on a longer side.
    nodes[6] = [1.0, 0.5];
    let hanging = ["3 2 2 1 10 20 30 40", "3 2 2 1 20 50 60 70"];
    let text = said(&nodes[..7], &hanging);
    assert!(
        text.contains("lies on a side") && text.contains("node 70"),
        "{text}"
    );
    // References to nothing.
    assert!(said(&SQUARE, &["3 2 2 1 10 20 30 99"]).contains("element 100 refers to node 99"));
    assert!(
        said(&SQUARE, &["3 2 2 1 10 20 30 40", "1 2 1 1 10 30"])
            .contains("line 101 of the group `edge` is no side")
    );
    assert!(
        said(&SQUARE, &["3 2 2 1 10 20 30 40", "15 2 3 1 60"])
            .contains("node 60 of the group `pin` belongs to no element")
    );
}

#[test]
fn names_that_conditions_could_not_tell_apart_are_refused() {
    let text = String::from_utf8(bytes("plate-41-ascii")).unwrap();
    let clash = text.replace("0 10 \"corner\"", "0 10 \"left\"");
    let errors = refused(clash.as_bytes());
    assert!(
        errors[0]
            .to_string()
            .contains("two groups `left`, points and lines"),
        "{}",
        errors[0]
    );
    // A surface may be called like a line: they are named at different places of the input.
    let surface = text.replace("2 7 \"soft\"", "2 7 \"left\"");
    assert!(
        gmsh::read(surface.as_bytes(), "f")
            .unwrap()
            .groups
            .contains_key("left")
    );
}

#[test]
fn numbers_of_nodes_may_be_as_large_as_gmsh_allows() {
    let huge = 1_u64 << 60;
    let text = format!(
        "$MeshFormat\r\n4.1 0 8\r\n$EndMeshFormat\r\n$Nodes\r\n1 4 {huge} {}\r\n2 1 0 4\r\n{}\r\n{}\r\n{huge}\r\n{}\r\n1 1 0\r\n0 1 0\r\n0 0 0\r\n1 0 0\r\n$EndNodes\r\n$Elements\r\n1 1 1 1\r\n2 1 3 1\r\n7 {huge} {} {} {}\r\n$EndElements\r\n",
        huge + 3,
        huge + 2,
        huge + 3,
        huge + 1,
        huge + 1,
        huge + 2,
        huge + 3
    );
    let mesh = gmsh::read(text.as_bytes(), "f").unwrap();
    // The order is that of the file.
    assert_eq!(mesh.nodes, [[1.0, 1.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0]]);
    assert_eq!(mesh.connectivity, [2, 3, 0, 1]);
}

/// Machines that store the highest byte first are rare; their files are read all the same.
#[test]
fn the_order_of_bytes_is_that_of_the_file() {
    let build = |int: fn(i32) -> [u8; 4], double: fn(f64) -> [u8; 8]| {
        let mut file = b"$MeshFormat\n2.2 1 8\n".to_vec();
        file.extend(int(1));
        file.extend(b"\n$EndMeshFormat\n$Nodes\n4\n");
        for (number, [x, y]) in SQUARE[..4].iter().enumerate() {
            file.extend(int(number as i32 + 1));
            [*x, *y, 0.0].iter().for_each(|&x| file.extend(double(x)));
        }
        file.extend(b"\n$EndNodes\n$Elements\n1\n");
        [3, 1, 2, 1, 0, 1, 1, 2, 3, 4]
            .iter()
            .for_each(|&n| file.extend(int(n)));
        file.extend(b"\n$EndElements\n");
        gmsh::read(&file, "f").unwrap()
    };
    let little = build(i32::to_le_bytes, f64::to_le_bytes);
    assert_eq!(build(i32::to_be_bytes, f64::to_be_bytes), little);
    assert_eq!(little.nodes[2], [1.0, 1.0]);
}

/// Every file cut off anywhere, with bytes changed, doubled and left out: an answer in words, never a panic, and no
/// memory for what a count promises and the file does not hold.
#[test]
fn no_damage_to_a_file_makes_the_reader_panic() {
    let mut random = 0x2545_f491_4f6c_dd1d_u64;
    let mut next = |below: usize| {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        (random % below.max(1) as u64) as usize
    };
    let mut taken = 0;
    let names = FLAVOURS.iter().copied().chain([
        "plate-q9",
        "plate-q4",
        "plate-t6",
        "refused-partitioned",
        "refused-solid",
    ]);
    for name in names {
        let whole = bytes(name);
        for end in (0..whole.len()).step_by(7) {
            let _ = gmsh::read(&whole[..end], "f");
        }
        for _ in 0..400 {
            let mut damaged = whole.clone();
            for _ in 0..=next(3) {
                let at = next(damaged.len());
                match next(4) {
                    0 => damaged[at] = next(256) as u8,
                    1 => damaged[at] ^= 1 << next(8),
                    2 => {
                        let end = (at + next(40)).min(damaged.len());
                        damaged.drain(at..end);
                    }
                    _ => {
                        let end = (at + next(40)).min(damaged.len());
                        let piece = damaged[at..end].to_vec();
                        damaged.splice(at..at, piece);
                    }
                }
            }
            taken += usize::from(gmsh::read(&damaged, "f").is_ok());
        }
    }
    assert!(taken > 0, "some damage hits what does not matter");
    // Counts as large as numbers go.
    let text = String::from_utf8(bytes("plate-41-ascii")).unwrap();
    for (from, to) in [
        (
            "19 83 1 83",
            "18446744073709551615 18446744073709551615 1 83",
        ),
        ("8 9 2 0\n", "8 9 2 9999999999999999\n"),
    ] {
        assert!(text.contains(from));
        refused(text.replace(from, to).as_bytes());
    }
    let text = String::from_utf8(bytes("plate-22-ascii")).unwrap();
    refused(
        text.replace("$Elements\n", "$Elements\n99999999999")
            .as_bytes(),
    );
}

const INPUT: &str = "\
name: plate
mesh: { gmsh: { file: plate.msh } }
materials:
  hard: { elastic: { young: 100.0, poisson: 0.25, initial_stress: -1.0 } }
  soft: { elastic: { young: 50.0, poisson: 0.25, initial_stress: -1.0 } }
material: hard
regions:
  - { name: left part, group: soft, material: soft }
loads: { down: 0.0 }
boundary:
  - { on: left, displacement: { x: 0 } }
  - { on: right, displacement: { x: 0 } }
  - { on: bottom, displacement: { y: 0 } }
  - { on: top, displacement: { y: down } }
  - { on: slot, pressure: 1.0 }
programme:
  - { name: press, ramp: { down: -0.001 }, steps: 2 }
";

#[test]
fn a_run_keeps_its_mesh_and_does_not_need_the_file_any_more() {
    let bench = Bench::new();
    for (name, element, points) in [
        ("plate-41-binary", "Q8", 4),
        ("plate-t6", "T6_full", 6),
        ("plate-q4", "Q4", 4),
    ] {
        fs::copy(path(name), bench.path("plate.msh")).unwrap();
        let input = INPUT
            .replace("name: plate", &format!("name: {name}"))
            .replace("plate.msh }", &format!("plate.msh, element: {element} }}"));
        fs::write(bench.path("plate.yaml"), input).unwrap();
        bench.submit("plate.yaml");
        fs::remove_file(bench.path("plate.msh")).unwrap();
        let elements = mesh(name).element_count();
        let show = bench.run(&["show", name, "--json"]).good().json();
        assert_eq!(
            (
                &show["element"],
                show["elements"].as_u64(),
                show["gauss_points"].as_u64()
            ),
            (
                &element.into(),
                Some(elements as u64),
                Some((elements * points) as u64)
            )
        );
        let text = bench.run(&["show", name]).good().out;
        assert!(text.contains("mesh of plate.msh"), "{text}");
        bench
            .run(&["export", name, "--into", &bench.arg(name)])
            .good();
        let (names, rows) = common::curve(&bench.path(name).join("curves.csv"));
        let at = |name: &str| rows[2][names.iter().position(|have| have == name).unwrap()];
        // Pressed, the slot closes a little: less than with nothing missing, E' = 120 and 60.
        assert!(
            (at("uy_top") + 0.001).abs() < 1e-12 && (-1.12..-1.05).contains(&at("syy")),
            "{}",
            at("syy")
        );
        // The programme goes on from what the store holds.
        let branch = bench.run(&[
            "branch",
            &format!("{name}@1"),
            "--programme",
            "{ up: { ramp: { down: 0.0 }, steps: 1 } }",
            "--json",
        ]);
        assert_eq!(branch.good().json()["runs"][0]["state"], "completed");
    }
}

#[test]
fn an_input_that_names_a_wrong_mesh_says_where_and_what() {
    let bench = Bench::new();
    let said = |from: &str, to: &str| {
        fs::write(bench.path("plate.yaml"), INPUT.replace(from, to)).unwrap();
        let outcome = bench.run(&["submit", &bench.arg("plate.yaml")]);
        assert_eq!(outcome.code, 2, "{}", outcome.err);
        outcome.err
    };
    let missing = said("", "");
    assert!(
        missing.contains("there is no file `plate.msh`") && missing.contains("plate.yaml:2:23"),
        "{missing}"
    );
    assert!(!missing.contains("has no boundary"), "{missing}");
    fs::copy(path("plate-41-ascii"), bench.path("plate.msh")).unwrap();
    let group = said("group: soft", "group: sofd");
    assert!(
        group.contains("has no group of surfaces `sofd`") && group.contains("did you mean `soft`"),
        "{group}"
    );
    let element = said("plate.msh }", "plate.msh, element: T6 }");
    assert!(element.contains("has Q8 elements, not T6"), "{element}");
    let boundary = said("on: slot", "on: slott");
    assert!(
        boundary.contains("no boundary `slott`") && boundary.contains("`slot`"),
        "{boundary}"
    );
    let inside = said("on: slot", "on: seam");
    assert!(
        inside.contains("`seam` names nodes; pressure acts along a boundary"),
        "{inside}"
    );
    let both = said("group: soft", "group: soft, elements: [1]");
    assert!(
        both.contains("exactly one of `elements`, `box` and `group`"),
        "{both}"
    );
    // Several faults of the file at once.
    fs::copy(path("refused-t3"), bench.path("plate.msh")).unwrap();
    let triangles = said("", "");
    assert!(triangles.contains("Mesh.ElementOrder = 2"), "{triangles}");
    // No group: there is nothing to name.
    fs::copy(path("refused-no-groups"), bench.path("plate.msh")).unwrap();
    let nothing = said("    ", "    ");
    assert!(
        nothing.contains("no boundary `left`") && nothing.contains("there are no"),
        "{nothing}"
    );
}
