//! Fields of a body, for ParaView.
//!
//! `fields-<step>.vtu` is the initial mesh, in cells of the run's element; "Warp By Vector" with `displacement` shows the
//! deformed one.
//!
//! | data | array | meaning |
//! |---|---|---|
//! | points | `displacement` | from the initial position |
//! | points | `stress`, `strain`, `shear_strain` | extrapolated from the Gauss points, averaged over the elements of a node: smooth, peaks are lowered |
//! | cells | the same, `void_ratio`, `coordination` | mean over the Gauss points of the element |
//! | cells | `rev_cost` | CPU seconds of the element's REVs in the step |
//! | cells | `region`, `material` | numbers, from 0 |
//!
//! With a second gradient, and NaN where elements are plain:
//!
//! | data | array | meaning |
//! |---|---|---|
//! | points | `gradient` | v, the sum of its increments: what stands for the displacement gradient |
//! | cells | `multiplier` | λ, the stress that ties v to it; row by row |
//! | cells | `double_stress` | √(χ:χ), mean over the Gauss points |
//! | cells | `gradient_mismatch` | how far the displacement gradient of the last step and v part inside the element, over its size: what a λ constant in the element leaves |
//!
//! `points-<step>.vtu` has one vertex a Gauss point, at its initial position, with `displacement`, `element`,
//! `gauss_point` and the values as computed; `rev_cost` is the mean of the element there.
//!
//! Stress is Cauchy stress, positive in tension. Strain is the logarithmic strain ½ ln(F Fᵀ) from the initial mesh,
//! positive in extension. `shear_strain` is √(⅔ e:e) with its deviator e. The out-of-plane components of tensors are
//! not computed and written as zero. Elastic points have no grains: their `void_ratio` and `coordination` are NaN,
//! which ParaView draws in a colour of its own.

use std::path::Path;

use solver_fem::{Tensor2, newton::MacroState, post};

use super::{ExportError, body::BodyResults, second_gradient};
use crate::{
    input::Field,
    output::vtu::{self, Array, CellKind, Grid, Values},
    run::{point::PointState, view::StepView},
};

/// Writes both files of a step into `folder`; returns their names.
pub fn write(
    results: &BodyResults<'_>,
    step: &StepView,
    state: &MacroState<2>,
    wanted: &[Field],
    folder: &Path,
) -> Result<[String; 2], ExportError> {
    let points = PointFields::of(results, step, state)?;
    let index = step.record.index.0;
    let names = [
        format!("fields-{index:04}.vtu"),
        format!("points-{index:04}.vtu"),
    ];
    write_mesh(results, state, &points, wanted, &folder.join(&names[0]))?;
    write_points(results, state, &points, wanted, &folder.join(&names[1]))?;
    Ok(names)
}

/// Values at every Gauss point, in order.
struct PointFields {
    stress: Vec<Tensor2<2>>,
    strain: Vec<Tensor2<2>>,
    shear_strain: Vec<f64>,
    void_ratio: Vec<f64>,
    coordination: Vec<f64>,
    /// By element.
    cost: Vec<f64>,
}

impl PointFields {
    fn of(
        results: &BodyResults<'_>,
        step: &StepView,
        state: &MacroState<2>,
    ) -> Result<Self, ExportError> {
        let problem = &results.model.problem;
        let gradients = post::deformation_gradients(problem, &state.coordinates);
        let strain: Vec<Tensor2<2>> = gradients.iter().map(post::logarithmic).collect();
        let states = results.points(step)?;
        let grains = |value: fn(&crate::run::point::PlaneRev) -> f64| {
            let of_point = |point: &PointState| match point {
                PointState::Rev(rev) => value(rev),
                PointState::Elastic { .. } => f64::NAN,
            };
            states.iter().map(|point| of_point(point)).collect()
        };
        Ok(Self {
            stress: problem
                .gauss_points()
                .map(|point| state.stress_at(point))
                .collect(),
            shear_strain: strain.iter().map(post::second_invariant).collect(),
            strain,
            void_ratio: grains(|rev| rev.void_ratio()),
            coordination: grains(|rev| rev.coordination()),
            cost: results.cost(step)?,
        })
    }

    /// A scalar field, where it is one.
    fn scalar(&self, field: Field) -> Option<&[f64]> {
        match field {
            Field::ShearStrain => Some(&self.shear_strain),
            Field::VoidRatio => Some(&self.void_ratio),
            Field::Coordination => Some(&self.coordination),
            Field::Displacement
            | Field::Stress
            | Field::Strain
            | Field::RevCost
            | Field::SecondGradient => None,
        }
    }

    /// A tensor field, where it is one.
    fn tensor(&self, field: Field) -> Option<&[Tensor2<2>]> {
        match field {
            Field::Stress => Some(&self.stress),
            Field::Strain => Some(&self.strain),
            _ => None,
        }
    }
}

/// Name of a field in the files.
fn name(field: Field) -> &'static str {
    match field {
        Field::Displacement => "displacement",
        Field::Stress => "stress",
        Field::Strain => "strain",
        Field::ShearStrain => "shear_strain",
        Field::VoidRatio => "void_ratio",
        Field::Coordination => "coordination",
        Field::RevCost => "rev_cost",
        Field::SecondGradient => "second_gradient",
    }
}

/// An array that owns its values.
pub(super) struct Owned {
    name: &'static str,
    values: OwnedValues,
}

enum OwnedValues {
    Scalar(Vec<f64>),
    Vector(Vec<[f64; 2]>),
    Tensor(Vec<Tensor2<2>>),
}

impl Owned {
    pub fn scalar(name: &'static str, values: Vec<f64>) -> Self {
        Self {
            name,
            values: OwnedValues::Scalar(values),
        }
    }

    pub fn tensor(name: &'static str, values: Vec<Tensor2<2>>) -> Self {
        Self {
            name,
            values: OwnedValues::Tensor(values),
        }
    }

    fn array(&self) -> Array<'_, 2> {
        let values = match &self.values {
            OwnedValues::Scalar(values) => Values::Scalar(values),
            OwnedValues::Vector(values) => Values::Vector(values),
            OwnedValues::Tensor(values) => Values::Tensor(values),
        };
        Array {
            name: self.name,
            values,
        }
    }
}

fn arrays(owned: &[Owned]) -> Vec<Array<'_, 2>> {
    owned.iter().map(Owned::array).collect()
}

fn write_mesh(
    results: &BodyResults<'_>,
    state: &MacroState<2>,
    points: &PointFields,
    wanted: &[Field],
    path: &Path,
) -> Result<(), ExportError> {
    let problem = &results.model.problem;
    let mesh = problem.mesh();
    let per_element = problem.points_per_element();
    let (mut at_nodes, mut at_cells) = (Vec::new(), Vec::new());
    for &field in wanted {
        let name = name(field);
        if let Some(values) = points.tensor(field) {
            let flat: Vec<f64> = values.iter().flatten().flatten().copied().collect();
            let smooth = post::nodal_average(problem, &flat, 4);
            let smooth = smooth
                .chunks_exact(4)
                .map(|t| [[t[0], t[1]], [t[2], t[3]]])
                .collect();
            at_nodes.push(Owned::tensor(name, smooth));
            at_cells.push(Owned::tensor(name, mean_tensors(values, per_element)));
        } else if let Some(values) = points.scalar(field) {
            // Where elastic elements lie beside grains, the mean of a node would be NaN on both sides.
            if field == Field::ShearStrain {
                at_nodes.push(Owned::scalar(name, post::nodal_average(problem, values, 1)));
            }
            at_cells.push(Owned::scalar(name, means(values, per_element)));
        } else if field == Field::Displacement {
            let nodes = (0..mesh.nodes.len())
                .map(|node| state.displacement_of(node))
                .collect();
            at_nodes.push(Owned {
                name,
                values: OwnedValues::Vector(nodes),
            });
        } else if field == Field::RevCost {
            at_cells.push(Owned::scalar(name, points.cost.clone()));
        } else if field == Field::SecondGradient {
            let (nodes, cells) = second_gradient::over_mesh(problem, state);
            at_nodes.extend(nodes);
            at_cells.extend(cells);
        }
    }
    at_cells.push(Owned::scalar(
        "region",
        mesh.regions.iter().map(|&k| k as f64).collect(),
    ));
    at_cells.push(Owned::scalar(
        "material",
        results.model.materials.iter().map(|&k| k as f64).collect(),
    ));
    let connectivity: Vec<u32> = mesh.connectivity.iter().map(|&node| node as u32).collect();
    let grid = Grid {
        points: &mesh.nodes,
        kind: results.model.cell_kind(),
        connectivity: &connectivity,
    };
    Ok(vtu::write(
        path,
        &grid,
        &arrays(&at_nodes),
        &arrays(&at_cells),
    )?)
}

fn write_points(
    results: &BodyResults<'_>,
    state: &MacroState<2>,
    points: &PointFields,
    wanted: &[Field],
    path: &Path,
) -> Result<(), ExportError> {
    let problem = &results.model.problem;
    let per_element = problem.points_per_element();
    let initial = problem.gauss_point_positions(problem.initial());
    let located = |part: fn((usize, usize)) -> usize| {
        problem
            .gauss_points()
            .map(|point| part(problem.locate(point)) as f64)
            .collect()
    };
    let mut data = vec![
        Owned::scalar("element", located(|(element, _)| element)),
        Owned::scalar("gauss_point", located(|(_, local)| local)),
    ];
    for &field in wanted {
        let name = name(field);
        if let Some(values) = points.tensor(field) {
            data.push(Owned::tensor(name, values.to_vec()));
        } else if let Some(values) = points.scalar(field) {
            data.push(Owned::scalar(name, values.to_vec()));
        } else if field == Field::Displacement {
            let now = problem.gauss_point_positions(&state.coordinates);
            let moved = now
                .iter()
                .zip(&initial)
                .map(|(x, start)| [x[0] - start[0], x[1] - start[1]]);
            data.push(Owned {
                name,
                values: OwnedValues::Vector(moved.collect()),
            });
        } else if field == Field::RevCost {
            let share = |cost: &f64| std::iter::repeat_n(cost / per_element as f64, per_element);
            data.push(Owned::scalar(
                name,
                points.cost.iter().flat_map(share).collect(),
            ));
        } else if field == Field::SecondGradient {
            data.extend(second_gradient::at_points(state));
        }
    }
    let connectivity: Vec<u32> = (0..initial.len() as u32).collect();
    let grid = Grid {
        points: &initial,
        kind: CellKind::Vertex,
        connectivity: &connectivity,
    };
    Ok(vtu::write(path, &grid, &arrays(&data), &[])?)
}

fn means(values: &[f64], per_element: usize) -> Vec<f64> {
    values
        .chunks(per_element)
        .map(|chunk| chunk.iter().sum::<f64>() / chunk.len() as f64)
        .collect()
}

fn mean_tensors(values: &[Tensor2<2>], per_element: usize) -> Vec<Tensor2<2>> {
    let component = |chunk: &[Tensor2<2>], i: usize, j: usize| {
        chunk.iter().map(|t| t[i][j]).sum::<f64>() / chunk.len() as f64
    };
    values
        .chunks(per_element)
        .map(|chunk| std::array::from_fn(|i| std::array::from_fn(|j| component(chunk, i, j))))
        .collect()
}
