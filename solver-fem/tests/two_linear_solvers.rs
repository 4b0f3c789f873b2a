//! Two solvers that share nothing but the checks around them must find the same solution.
//!
//! A wrong entry in one of a thousand fronts shows as slow convergence of Newton, or not at all: the residual of a
//! correction is not looked at. So the systems vary in all that decides the fronts: shape of the mesh, numbering of
//! elements and equations, fields, dimension.

#[path = "common/systems.rs"]
mod systems;

use std::sync::Arc;

use proptest::prelude::*;
use solver_fem::assembly::Pattern;
use solver_fem::layout::Field;
use solver_fem::linear_solver::{LinearError, Method};
use solver_fem::mesh::Mesh;
use systems::{Noise, System, Unknowns, assemble, specimen};

/// Both solutions, each checked against the equations.
fn solve_both<const D: usize>(system: &System<D>, rhs: &[f64]) -> [Vec<f64>; 2] {
    [Method::Multifrontal, Method::Faer].map(|method| {
        let solver = method
            .analyse(&system.pattern, system.fields.clone(), &system.centres)
            .expect("analysed");
        let factors = solver.factorise(&system.values).expect("regular");
        let solution = factors.solve(rhs).expect("finite");
        assert!(
            solution.relative_residual <= 1e-12,
            "{method:?}: {:e}",
            solution.relative_residual
        );
        solution.x
    })
}

fn assert_agreement<const D: usize>(system: &System<D>) {
    let (rhs, _) = system.known();
    let [a, b] = solve_both(system, &rhs);
    let difference: f64 = a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum();
    let size: f64 = b.iter().map(|b| b * b).sum();
    let relative = (difference / size).sqrt();
    assert!(relative <= 1e-9, "{relative:e}");
}

/// Elements of a specimen that lie in a given shape, which holds together and reaches down to y = 0.
#[derive(Clone, Copy, Debug)]
enum Shape {
    Whole,
    /// Without the upper right quarter.
    Angle,
    /// Without the middle, where there are three elements side by side.
    Hole,
}

fn elements_of(mesh: &Mesh<2>, shape: Shape) -> Vec<usize> {
    let wide = mesh.boundaries["bottom"].len() >= 3;
    let lies_in = |&element: &usize| {
        let [x, y] = mesh.element_centre(element);
        match shape {
            // A mesh of one element in a direction has its centres on the line, and keeps them.
            Shape::Angle => x < 0.51 || y < 1.01,
            Shape::Hole if wide => (x - 0.5).abs() > 0.26 || (y - 1.0).abs() > 0.5,
            Shape::Whole | Shape::Hole => true,
        }
    };
    (0..mesh.element_count()).filter(lies_in).collect()
}

/// A mesh whose nodes were moved by up to a tenth of an element.
fn distort(mesh: &mut Mesh<2>, elements: [usize; 2], noise: &mut Noise) {
    for node in &mut mesh.nodes {
        let held = node[1] == 0.0;
        node[0] += 0.1 * noise.next() / elements[0] as f64;
        if !held {
            node[1] += 0.2 * noise.next() / elements[1] as f64;
        }
    }
}

/// The same system with other numbers for its equations and its elements.
fn renumbered<const D: usize>(system: &System<D>, noise: &mut Noise) -> System<D> {
    let mut shuffled = |count: usize| {
        let mut order: Vec<usize> = (0..count).collect();
        let keys: Vec<f64> = (0..count).map(|_| noise.next()).collect();
        order.sort_by(|&a, &b| keys[a].total_cmp(&keys[b]));
        order
    };
    let old = &system.pattern;
    let new_number = shuffled(old.size);
    let order = shuffled(old.element_count());
    let equations: Vec<Vec<Option<usize>>> = order
        .iter()
        .map(|&element| {
            let equations = old.element_equations(element).iter();
            equations
                .map(|e| e.map(|e| new_number[e as usize]))
                .collect()
        })
        .collect();
    let pattern = Pattern::of_elements(old.size, &equations);
    let mut values = vec![0.0; pattern.entry_count()];
    let mut fields = system.fields.clone();
    for column in 0..old.size {
        let to = new_number[column];
        fields[to] = system.fields[column];
        for entry in old.columns[column]..old.columns[column + 1] {
            let range = pattern.columns[to]..pattern.columns[to + 1];
            let place = pattern.rows[range].binary_search(&new_number[old.rows[entry]]);
            values[pattern.columns[to] + place.expect("the same pattern")] = system.values[entry];
        }
    }
    System {
        pattern: Arc::new(pattern),
        fields,
        centres: order.iter().map(|&e| system.centres[e]).collect(),
        values,
    }
}

/// Bricks of 8 nodes with three unknowns and a multiplier each, one corner of the block held; matrices by chance.
fn bricks(count: [usize; 3], noise: &mut Noise) -> System<3> {
    let nodes = count.map(|n| n + 1);
    let node = |i: usize, j: usize, k: usize| (k * nodes[1] + j) * nodes[0] + i;
    let node_count: usize = nodes.iter().product();
    let size = 3 * node_count - 3 + count.iter().product::<usize>();
    let mut equations = Vec::new();
    let mut centres = Vec::new();
    for k in 0..count[2] {
        for j in 0..count[1] {
            for i in 0..count[0] {
                let corners = (0..8).map(|c| node(i + c % 2, j + c / 2 % 2, k + c / 4));
                let unknowns = corners.flat_map(|n| (0..3).map(move |a| 3 * n + a));
                let mut own: Vec<_> = unknowns.map(|dof| dof.checked_sub(3)).collect();
                own.push(Some(3 * node_count - 3 + equations.len()));
                equations.push(own);
                centres.push([i as f64, j as f64, k as f64]);
            }
        }
    }
    let pattern = Pattern::of_elements(size, &equations);
    let mut values = vec![0.0; pattern.entry_count()];
    for element in 0..equations.len() {
        for row in 0..25 {
            for column in 0..25 {
                let value = match (row, column) {
                    (24, 24) => 0.0,
                    _ if row == column => 6.0 + noise.next(),
                    _ => noise.next(),
                };
                if let Some(entry) = pattern.entry(element, row, column) {
                    values[entry] += value;
                }
            }
        }
    }
    let mut fields = vec![Field::Displacement; size];
    fields[3 * node_count - 3..].fill(Field::Multiplier);
    System {
        pattern: Arc::new(pattern),
        fields,
        centres,
        values,
    }
}

fn unknowns() -> impl Strategy<Value = Unknowns> {
    prop_oneof![
        Just(Unknowns::Displacement),
        // The second gradient's modulus over E·L², from an internal length far below an element to the body's.
        (-6.0..0.0_f64).prop_map(|exponent| Unknowns::SecondGradient(10.0_f64.powf(exponent))),
    ]
}

fn shape() -> impl Strategy<Value = Shape> {
    prop_oneof![Just(Shape::Whole), Just(Shape::Angle), Just(Shape::Hole)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn both_agree_on_distorted_meshes_of_any_shape_and_numbering(
        nx in 1_usize..9,
        ny in 1_usize..13,
        shape in shape(),
        unknowns in unknowns(),
        seed in any::<u64>(),
    ) {
        let mut noise = Noise(seed);
        let mut mesh = specimen([nx, ny]);
        let keep = elements_of(&mesh, shape);
        distort(&mut mesh, [nx, ny], &mut noise);
        let system = assemble(&mesh, &keep, unknowns, seed);
        assert_agreement(&system);
        assert_agreement(&renumbered(&system, &mut noise));
    }

    #[test]
    fn both_agree_in_three_dimensions(
        x in 1_usize..5,
        y in 1_usize..5,
        z in 1_usize..5,
        seed in any::<u64>(),
    ) {
        assert_agreement(&bricks([x, y, z], &mut Noise(seed)));
    }
}

/// Elements come from one row here: the order is that of a chain, and every separator is one side.
#[test]
fn both_agree_on_the_mesh_of_a_bar() {
    let mesh = specimen([1, 200]);
    let all: Vec<usize> = (0..200).collect();
    assert_agreement(&assemble(&mesh, &all, Unknowns::SecondGradient(1e-2), 3));
    assert_agreement(&assemble(&mesh, &all, Unknowns::Displacement, 3));
}

/// Moduli in pascals and lengths in millimetres: a saddle point is no worse for its units, and is not
/// taken for singular.
#[test]
fn units_decide_neither_pivots_nor_what_is_singular() {
    let mesh = specimen([4, 8]);
    let all: Vec<usize> = (0..32).collect();
    let mut system = assemble(&mesh, &all, Unknowns::SecondGradient(1e-3), 5);
    let (stress, length) = (1e9, 1e-3);
    // u in lengths, v without unit, λ in stresses.
    let unit = |field: Field| match field {
        Field::Displacement => length,
        Field::Gradient => 1.0,
        Field::Multiplier => stress,
    };
    let pattern = Arc::clone(&system.pattern);
    for column in 0..pattern.size {
        for entry in pattern.columns[column]..pattern.columns[column + 1] {
            let [row, column] =
                [pattern.rows[entry], column].map(|equation| unit(system.fields[equation]));
            system.values[entry] *= length * length * stress / (row * column);
        }
    }
    let exact: Vec<f64> = (0..pattern.size)
        .map(|i| (0.37 * i as f64).sin() * unit(system.fields[i]))
        .collect();
    let rhs = pattern.multiply(&system.values, &exact);
    for x in solve_both(&system, &rhs) {
        for ((x, exact), &field) in x.iter().zip(&exact).zip(&system.fields) {
            assert!((x - exact).abs() < 1e-9 * unit(field));
        }
    }
}

/// A stiff inclusion, as an elastic platen among grains: scaled by means over the whole body its unknowns
/// would find no pivots, and fronts would grow with what waits.
#[test]
fn both_agree_on_a_stiff_inclusion() {
    let mesh = specimen([8, 16]);
    let all: Vec<usize> = (0..128).collect();
    for contrast in [1e3_f64, 1e6] {
        let mut system = assemble(&mesh, &all, Unknowns::SecondGradient(1e-3), 4);
        let pattern = Arc::clone(&system.pattern);
        // Stiffness and modulus times the contrast, couplings to λ as they are.
        let mut factor = vec![1.0; pattern.size];
        for element in 0..all.len() {
            let [x, y] = system.centres[element];
            if (x - 0.5).abs() + (y - 1.0).abs() > 0.4 {
                continue;
            }
            for &equation in pattern.element_equations(element).iter().flatten() {
                let equation = equation as usize;
                factor[equation] = match system.fields[equation] {
                    Field::Multiplier => 1.0 / contrast.sqrt(),
                    _ => contrast.sqrt(),
                };
            }
        }
        for column in 0..pattern.size {
            for entry in pattern.columns[column]..pattern.columns[column + 1] {
                system.values[entry] *= factor[pattern.rows[entry]] * factor[column];
            }
        }
        if contrast == 1e3 {
            assert_agreement(&system);
        } else {
            // Neither is nearer to the known solution than 1e-9, such is the condition: residuals only.
            solve_both(&system, &system.known().0);
        }
    }
}

/// A node that lost its stiffness, wholly or but for a trace.
#[test]
fn both_name_the_same_motion_without_stiffness() {
    let mesh = specimen([6, 12]);
    let all: Vec<usize> = (0..72).collect();
    for unknowns in [Unknowns::Displacement, Unknowns::SecondGradient(1e-2)] {
        for trace in [0.0, 1e-16] {
            let mut system = assemble(&mesh, &all, unknowns, 9);
            let lost = 100;
            let pattern = Arc::clone(&system.pattern);
            for column in 0..pattern.size {
                for entry in pattern.columns[column]..pattern.columns[column + 1] {
                    if column == lost || pattern.rows[entry] == lost {
                        system.values[entry] *= trace;
                    }
                }
            }
            for method in [Method::Multifrontal, Method::Faer] {
                let solver = method
                    .analyse(&pattern, system.fields.clone(), &system.centres)
                    .expect("analysed");
                match solver.factorise(&system.values).err() {
                    Some(LinearError::Singular {
                        equation,
                        amplification,
                    }) => {
                        assert_eq!(equation, lost, "{method:?}");
                        assert!(amplification >= 1e14);
                    }
                    other => panic!("{method:?} did not see it: {other:?}"),
                }
            }
        }
    }
}

#[test]
fn what_is_no_number_is_refused() {
    let mesh = specimen([3, 6]);
    let all: Vec<usize> = (0..18).collect();
    let system = assemble(&mesh, &all, Unknowns::SecondGradient(1e-2), 2);
    for method in [Method::Multifrontal, Method::Faer] {
        let solver = method
            .analyse(&system.pattern, system.fields.clone(), &system.centres)
            .expect("analysed");
        let mut values = system.values.clone();
        values[77] = f64::NAN;
        assert_eq!(
            solver.factorise(&values).err(),
            Some(LinearError::NonFinite)
        );
        assert_eq!(
            solver.factorise(&values[1..]).err(),
            Some(LinearError::NonFinite)
        );
        let factors = solver.factorise(&system.values).expect("regular");
        let mut rhs = vec![1.0; system.pattern.size];
        rhs[5] = f64::INFINITY;
        assert_eq!(factors.solve(&rhs).err(), Some(LinearError::NonFinite));
        assert_eq!(factors.solve(&rhs[6..]).err(), Some(LinearError::NonFinite));
        let zero = factors
            .solve(&vec![0.0; system.pattern.size])
            .expect("finite");
        assert!(zero.x.iter().all(|&x| x == 0.0) && zero.relative_residual == 0.0);
    }
}
