//! Files for other programs: whole or absent, of the structure that VTK's readers insist on, exact in their numbers.

use workflows::output::WriteError;
use workflows::output::csv::{Column, Table};
use workflows::output::pvd::{self, Entry};
use workflows::output::vtp;
use workflows::output::vtu::{self, Array, CellKind, Grid, Values};

const POINTS: [[f64; 2]; 8] = [
    [0.0, 0.0],
    [1.0, 0.0],
    [1.0, 1.0],
    [0.0, 1.0],
    [0.5, 0.0],
    [1.0, 0.5],
    [0.5, 1.0],
    [0.0, 0.5],
];

fn grid() -> Grid<'static, 2> {
    Grid {
        points: &POINTS,
        kind: CellKind::QuadraticQuad,
        connectivity: &[0, 1, 2, 3, 4, 5, 6, 7],
    }
}

#[test]
fn a_grid_keeps_the_structure_that_readers_expect() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep/er/step.vtu");
    let displacement: Vec<[f64; 2]> = POINTS.iter().map(|[x, y]| [0.1 * x, -0.2 * y]).collect();
    let point_data = [Array {
        name: "displacement",
        values: Values::Vector(&displacement),
    }];
    let cell_data = [
        Array {
            name: "stress",
            values: Values::Tensor(&[[[-1.0, 0.5], [0.25, -2.0]]]),
        },
        Array {
            name: "void <ratio>",
            values: Values::Scalar(&[0.18]),
        },
    ];
    vtu::write(&path, &grid(), &point_data, &cell_data).unwrap();
    insta::assert_snapshot!(std::fs::read_to_string(&path).unwrap());
    let left: Vec<_> = std::fs::read_dir(path.parent().unwrap()).unwrap().collect();
    assert_eq!(left.len(), 1, "a temporary file stayed behind");
}

#[test]
fn an_array_of_the_wrong_length_is_refused_before_a_file_appears() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtu");
    let short = [Array {
        name: "void_ratio",
        values: Values::Scalar(&[]),
    }];
    let error = vtu::write(&path, &grid(), &[], &short).unwrap_err();
    assert!(matches!(
        error,
        WriteError::Count {
            expected: 1,
            found: 0,
            ..
        }
    ));
    let broken = Grid {
        connectivity: &[0, 1, 2, 3, 4, 5, 6, 8],
        ..grid()
    };
    assert!(matches!(
        vtu::write(&path, &broken, &[], &[]),
        Err(WriteError::Connectivity {
            cell: 0,
            point: 8,
            ..
        })
    ));
    assert!(!path.exists());
}

#[test]
fn grains_and_contacts_keep_the_structure_that_readers_expect() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rev.vtp");
    let grains = vtp::Points {
        points: &POINTS[..3],
        lines: &[[0, 1], [1, 2]],
    };
    let radius = [Array {
        name: "radius",
        values: Values::Scalar(&[0.5, 0.4, 0.3]),
    }];
    let force = [Array {
        name: "normal_force",
        values: Values::Scalar(&[1.0, 2.0]),
    }];
    vtp::write(&path, &grains, &radius, &force).unwrap();
    insta::assert_snapshot!(std::fs::read_to_string(&path).unwrap());
    let broken = vtp::Points {
        lines: &[[0, 3]],
        ..grains
    };
    assert!(matches!(
        vtp::write(&path, &broken, &[], &[]),
        Err(WriteError::Connectivity { .. })
    ));
}

#[test]
fn a_collection_names_its_files_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.pvd");
    let entries = [0.0, 1.0].map(|time| Entry {
        time,
        file: format!("steps/{time}.vtu"),
    });
    pvd::write(&path, &entries).unwrap();
    insta::assert_snapshot!(std::fs::read_to_string(&path).unwrap());
}

#[test]
fn a_curve_says_what_its_columns_mean_and_loses_no_digit() {
    let mut table = Table::new(vec![
        Column::new("step", "", "load step"),
        Column::new("axial", "stress", "tension positive"),
    ]);
    table.title.push("run hollow".to_owned());
    let values = [0.1 + 0.2, -1.0 / 3.0, 1e-300];
    for (step, value) in values.into_iter().enumerate() {
        table.push(vec![step as f64, value]).unwrap();
    }
    assert!(table.push(vec![1.0]).is_err());
    let text = table.to_text();
    assert!(text.starts_with(
        "# run hollow\n# step: load step\n# axial [stress]: tension positive\nstep,axial\n"
    ));
    let read: Vec<f64> = text
        .lines()
        .skip(4)
        .map(|row| row.split(',').nth(1).unwrap().parse().unwrap())
        .collect();
    assert_eq!(read, values);
}
