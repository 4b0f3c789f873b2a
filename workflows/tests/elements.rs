//! Bodies of every kind of element, from the input to the files for other programs: whatever counts Gauss points or
//! nodes must count those of the element.

mod common;

use std::fs;

use common::{BLOCK, Bench, curve};

/// Name, elements of a 2×2 grid, nodes of it, Gauss points of an element, VTK's number of the cell.
const ELEMENTS: [(&str, usize, usize, usize, u8); 5] = [
    ("Q8", 4, 21, 4, 23),
    ("Q8_full", 4, 21, 9, 23),
    ("Q4", 4, 9, 4, 9),
    ("T6", 8, 25, 3, 22),
    ("T6_full", 8, 25, 6, 22),
];

fn with_element(input: &str, element: &str) -> String {
    input.replace(
        " } }\nmaterials",
        &format!(", element: {element} }} }}\nmaterials"),
    )
}

#[test]
fn a_block_of_any_element_is_the_same_block() {
    for (element, elements, nodes, per_element, cell) in ELEMENTS {
        let bench = Bench::new();
        let input = with_element(BLOCK, element);
        assert!(input.contains(element));
        fs::write(bench.path("block.yaml"), input).unwrap();
        bench.submit("block.yaml");
        let show = bench.run(&["show", "block", "--json"]).good().json();
        let points = elements * per_element;
        assert_eq!(
            (
                &show["element"],
                show["elements"].as_u64(),
                show["gauss_points"].as_u64()
            ),
            (&element.into(), Some(elements as u64), Some(points as u64))
        );
        bench
            .run(&["export", "block", "--into", &bench.arg("out")])
            .good();
        let (names, rows) = curve(&bench.path("out/curves.csv"));
        let at = |name: &str| rows[3][names.iter().position(|have| have == name).unwrap()];
        // E(1 − ν)/((1 + ν)(1 − 2ν)) = 120; see `export_run.rs`.
        assert!(
            (at("syy") + 1.36).abs() < 2e-3 * 1.36,
            "{element}: {}",
            at("syy")
        );
        assert!((at("volume") - 0.997).abs() < 1e-9, "{element}");

        let mesh = fs::read_to_string(bench.path("out/fields-0003.vtu")).unwrap();
        let counts = format!(r#"NumberOfPoints="{nodes}" NumberOfCells="{elements}""#);
        assert!(mesh.contains(&counts), "{element}");
        assert_eq!(cell_types(&mesh), vec![cell; elements], "{element}");
        let vertices = fs::read_to_string(bench.path("out/points-0003.vtu")).unwrap();
        assert!(
            vertices.contains(&format!(r#"NumberOfPoints="{points}""#)),
            "{element}"
        );

        // Another element is another mesh, even on the same nodes.
        let last = format!("block@3:e{}.{}", elements - 1, per_element - 1);
        let beyond = format!("block@3:e0.{per_element}");
        assert_ne!(
            bench
                .run(&["rev", "export", &last, &bench.arg("rev.json")])
                .code,
            0
        );
        let refused = bench.run(&["rev", "export", &beyond, &bench.arg("rev.json")]);
        assert!(
            refused
                .err
                .contains(&format!("to e{}.{}", elements - 1, per_element - 1)),
            "{}",
            refused.err
        );
    }
}

/// The array `types` of a grid: base 64 of a length (8 bytes) and one byte a cell.
fn cell_types(vtu: &str) -> Vec<u8> {
    let at = vtu.find(r#"Name="types""#).unwrap();
    let text = vtu[at..].split(['>', '<']).nth(1).unwrap().trim();
    let digit = |c: u8| {
        let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        alphabet.iter().position(|&a| a == c).unwrap() as u32
    };
    let mut bytes = Vec::new();
    for quad in text.as_bytes().chunks(4) {
        let used = quad.iter().filter(|&&c| c != b'=').count();
        let word = quad[..used]
            .iter()
            .enumerate()
            .fold(0, |word, (k, &c)| word | digit(c) << (18 - 6 * k));
        bytes.extend(&word.to_be_bytes()[1..used]);
    }
    bytes[8..].to_vec()
}

/// Grains in triangles: killed and resumed or not, the same bits; a REV of it replays.
#[test]
fn grains_in_triangles_are_committed_and_replayed() {
    let bench = Bench::new();
    let input = with_element(BLOCK, "T6")
        .replace("elements: [2, 2]", "elements: [1, 1]")
        .replace(
            "rock: { elastic: { young: 100.0, poisson: 0.25, initial_stress: -1.0 } }",
            "rock: { rev: { grains: 30 } }",
        )
        .replace("-0.003 }, steps: 3", "-0.001 }, steps: 1");
    fs::write(bench.path("block.yaml"), input).unwrap();
    bench.submit("block.yaml");
    let replay = bench
        .run(&["replay", "block@1:e1.2", "--json"])
        .good()
        .json();
    assert!(replay.to_string().contains("e1.2"), "{replay}");
    assert_eq!(bench.run(&["replay", "block@1:e1.3"]).code, 2);
    bench.run(&["verify", "block"]).good();
}
