//! The curve of an element test: one row a committed step. `rev test` and `export` print the same one.

use std::sync::Arc;

use store::FrameId;

use super::{ExportError, LeftOut, place_columns, place_values};
use crate::{
    output::csv::{Column, Table},
    run::{
        element_test::TestState,
        error::RunError,
        frames::{MACRO, decode},
        load,
        point::PointState,
        view::{RunView, StepView, View},
    },
};

/// The curve of the element test `run`, damaged steps left out. It holds results only, no measured times: the same input
/// gives the same text.
pub fn test_curve(
    view: &View,
    run: &RunView,
    left_out: &mut LeftOut,
) -> Result<Table, ExportError> {
    let problem = &run.manifest.problem;
    let mut columns = place_columns(&problem.programme, &problem.loads);
    columns.extend([
        Column::new("exx", "", "F_xx − 1, positive in extension; F = [[1 + xx, xy], [0, 1 + yy]] from the initial cell"),
        Column::new("eyy", "", "F_yy − 1, likewise"),
        Column::new("exy", "", "F_xy: displacement of the top over the initial height"),
        Column::new("volume_strain", "", "det F − 1, positive in dilation"),
        Column::new("sxx", "stress", "Cauchy stress, positive in tension"),
        Column::new("syy", "stress", "likewise"),
        Column::new("sxy", "stress", "likewise"),
        Column::new("p", "stress", "mean stress −(sxx + syy)/2, positive in compression"),
        Column::new("q", "stress", "half the difference of the principal stresses, never negative"),
        Column::new("stress_ratio", "", "q/p, the sine of the mobilised friction angle without cohesion"),
        Column::new("void_ratio", "", "volume of voids over volume of grains"),
        Column::new("coordination", "", "mean number of contacts of a grain, rattlers included"),
        Column::new("rattlers", "", "grains with fewer than two contacts"),
        Column::new("residual", "", "largest unbalanced force in the REV over the mean contact force"),
        Column::new("cycles", "", "cycles of the REV solver in the step"),
    ]);
    let mut table = Table::new(columns);
    table.title = vec![
        format!("run {}: element test", run.name()),
        "units: those of the input; plane strain, per unit thickness".to_owned(),
    ];
    let dealt = load::dealt(&view.store, run.id())?;
    for step in &run.steps {
        if !left_out.admit(step) {
            continue;
        }
        let read = read(view, run, step, &dealt);
        let Some((state, points)) = left_out.unless_damaged(step, read)? else {
            continue;
        };
        let mut row = place_values(&problem.programme, problem.loads.len(), step);
        row.extend(mechanics(&state));
        row.extend(grains(&points[0]));
        row.extend(effort(step));
        table
            .push(row)
            .map_err(|error| RunError::State(error.to_string()))?;
    }
    Ok(table)
}

fn read(
    view: &View,
    run: &RunView,
    step: &StepView,
    dealt: &[Arc<PointState>],
) -> Result<(TestState, Vec<Arc<PointState>>), ExportError> {
    let reader = view.store.step(run.id(), step.record.index)?;
    let id = FrameId::new(MACRO, 0);
    let state = decode(id, &reader.frame(id)?).map_err(RunError::from)?;
    Ok((state, load::points(&reader, dealt)?))
}

/// p = −tr σ/2 and q = (σ1 − σ2)/2 = √(((σ_xx − σ_yy)/2)² + σ_xy²), by Mohr's circle.
fn mechanics(state: &TestState) -> [f64; 10] {
    let (f, s) = (&state.gradient, &state.stress);
    let shear = 0.5 * (s[0][1] + s[1][0]);
    let p = -0.5 * (s[0][0] + s[1][1]);
    let half = 0.5 * (s[0][0] - s[1][1]);
    let q = (half * half + shear * shear).sqrt();
    let volume_strain = f[0][0] * f[1][1] - f[0][1] * f[1][0] - 1.0;
    [
        f[0][0] - 1.0,
        f[1][1] - 1.0,
        f[0][1],
        volume_strain,
        s[0][0],
        s[1][1],
        shear,
        p,
        q,
        q / p,
    ]
}

fn grains(point: &PointState) -> [f64; 3] {
    match point {
        PointState::Rev(rev) => [rev.void_ratio(), rev.coordination(), rev.rattlers() as f64],
        PointState::Elastic { .. } => [f64::NAN; 3],
    }
}

fn effort(step: &StepView) -> [f64; 2] {
    [step.summary.residual, step.summary.revs.cycles as f64]
}
