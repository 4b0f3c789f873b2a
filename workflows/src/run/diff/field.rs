//! The mesh coloured by how far apart two runs are.
//!
//! | data | array | meaning |
//! |---|---|---|
//! | points | `displacement` | in the first run, from the initial position |
//! | points | `displacement_difference` | second minus first |
//! | cells | `stress_difference` | largest difference of a stress component at a Gauss point of the element |
//! | cells | `position_difference` | largest distance of a grain from where it is in the other run, over the mean diameter |
//! | cells | `contacts_difference` | contacts that one run has and the other has not |
//! | cells | `points_that_differ` | Gauss points of the element whose state or stress is not the same |

use std::path::Path;

use solver_fem::newton::MacroState;
use store::{FrameId, StepIndex};

use super::points::Apart;
use crate::{
    input::problem::Model as InputModel,
    output::{
        WriteError,
        vtu::{self, Array, Grid, Values},
    },
    run::{
        error::RunError,
        frames::{MACRO, decode},
        model::Model,
        view::{RunView, View},
    },
};

/// Why the picture could not be written.
#[derive(Debug, thiserror::Error)]
pub enum FieldError {
    /// One of the runs is an element test.
    #[error("an element test has no mesh to colour; leave `--output` out")]
    NoMesh,
    /// The meshes differ.
    #[error("the runs have different meshes, which cannot be coloured by one difference")]
    OtherMesh,
    /// A step cannot be read.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The file cannot be written.
    #[error("write the output: {0}")]
    Write(#[from] WriteError),
}

/// Writes the difference at `step` to `path`.
///
/// # Errors
/// Runs without a common mesh, or a file that cannot be written.
pub fn write(
    view: &View,
    runs: &[RunView; 2],
    step: StepIndex,
    apart: &[Apart],
    path: &Path,
) -> Result<(), FieldError> {
    let model = |run: &RunView| match &run.manifest.problem.model {
        InputModel::Body(body) => Ok(Model::new(body, run.manifest.problem.loads.len())?),
        InputModel::ElementTest(_) => Err(FieldError::NoMesh),
    };
    let (first, second) = (model(&runs[0])?, model(&runs[1])?);
    let mesh = first.problem.mesh();
    let other = second.problem.mesh();
    let alike = first.element == second.element;
    if !alike || mesh.nodes != other.nodes || mesh.connectivity != other.connectivity {
        return Err(FieldError::OtherMesh);
    }
    let displacement = |run: &RunView, model: &Model| -> Result<Vec<[f64; 2]>, FieldError> {
        // The initial state has moved nowhere.
        if step.0 == 0 {
            return Ok(vec![[0.0; 2]; mesh.nodes.len()]);
        }
        let id = FrameId::new(MACRO, 0);
        let reader = view.store.step(run.id(), step).map_err(RunError::from)?;
        let bytes = reader.frame(id).map_err(RunError::from)?;
        let state: MacroState<2> = decode(id, &bytes).map_err(RunError::from)?;
        let checked = state.check(&model.problem);
        checked.map_err(|error| RunError::State(error.to_string()))?;
        let nodes = 0..mesh.nodes.len();
        Ok(nodes.map(|node| state.displacement_of(node)).collect())
    };
    let (displacement, other) = (
        displacement(&runs[0], &first)?,
        displacement(&runs[1], &second)?,
    );
    let difference: Vec<[f64; 2]> = displacement
        .iter()
        .zip(&other)
        .map(|(x, y)| [y[0] - x[0], y[1] - x[1]])
        .collect();
    let per_element = first.problem.points_per_element();
    let largest = |value: fn(&Apart) -> f64| {
        let mut cells = vec![0.0_f64; mesh.element_count()];
        for one in apart {
            if let Some(cell) = cells.get_mut(one.point.index() / per_element) {
                *cell = cell.max(value(one));
            }
        }
        cells
    };
    let mut differing = vec![0.0; mesh.element_count()];
    for one in apart {
        if let Some(cell) = differing.get_mut(one.point.index() / per_element) {
            *cell += 1.0;
        }
    }
    let cells = [
        ("stress_difference", largest(|one| one.stress)),
        ("position_difference", largest(|one| one.positions)),
        ("contacts_difference", largest(|one| one.contacts as f64)),
        ("points_that_differ", differing),
    ];
    let cells: Vec<Array<'_, 2>> = cells
        .iter()
        .map(|(name, values)| Array {
            name,
            values: Values::Scalar(values),
        })
        .collect();
    let points = [
        Array {
            name: "displacement",
            values: Values::Vector(&displacement),
        },
        Array {
            name: "displacement_difference",
            values: Values::Vector(&difference),
        },
    ];
    let connectivity: Vec<u32> = mesh.connectivity.iter().map(|&node| node as u32).collect();
    let grid = Grid {
        points: &mesh.nodes,
        kind: first.cell_kind(),
        connectivity: &connectivity,
    };
    Ok(vtu::write(path, &grid, &points, &cells)?)
}
