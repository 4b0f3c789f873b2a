//! The curves of a body: one row a committed step.

use solver_fem::{
    boundary::{Cavity, Target},
    newton::MacroState,
    post,
};

use super::{ExportError, body::BodyResults, place_columns, place_values, places};
use crate::{
    input::problem::Body,
    output::csv::{Column, Table},
    run::{
        error::RunError,
        summary::Energy,
        view::{RunView, StepView},
    },
};

/// The table while it grows.
pub struct Curves<'a> {
    results: &'a BodyResults<'a>,
    run: &'a RunView,
    places: Vec<(String, Target)>,
    /// Cavities by the boundary that encloses them.
    cavities: Vec<Cavity<2>>,
    initial_volume: f64,
    /// Steps of the run whose work is in `energy`, also those that have no row.
    counted: usize,
    energy: Energy,
    table: Table,
}

impl<'a> Curves<'a> {
    /// An empty table for `run`.
    pub fn new(run: &'a RunView, results: &'a BodyResults<'a>, body: &Body) -> Self {
        let problem = &run.manifest.problem;
        let places = places(&results.model, body);
        let mut columns = place_columns(&problem.programme, &problem.loads);
        for (name, _) in &places {
            for axis in ["x", "y"] {
                let meaning = format!("mean displacement of the nodes of `{name}` along {axis}");
                columns.push(Column::new(format!("u{axis}_{name}"), "length", meaning));
            }
            for axis in ["x", "y"] {
                let meaning = format!(
                    "force along {axis} that the supports at the nodes of `{name}` exert on the body (applied pressures, tractions and body forces are no part of it)"
                );
                columns.push(Column::new(
                    format!("f{axis}_{name}"),
                    "force per thickness",
                    meaning,
                ));
            }
        }
        let mut cavities = Vec::new();
        for (name, target) in &places {
            // Most boundaries enclose nothing.
            if let Target::Boundary(boundary) = target
                && let Ok(cavity) = results.model.problem.cavity(boundary)
            {
                let meaning = format!(
                    "volume enclosed by `{name}` over its initial one − 1, that of the whole cavity or of the part in the mesh alike"
                );
                columns.push(Column::new(format!("expansion_{name}"), "", meaning));
                cavities.push(cavity);
            }
        }
        columns.extend([
            Column::new(
                "volume",
                "length²",
                "volume of the body per thickness, by its Gauss points",
            ),
            Column::new(
                "volume_strain",
                "",
                "volume over initial volume − 1, positive in dilation",
            ),
            Column::new(
                "sxx",
                "stress",
                "Cauchy stress, mean over the volume, positive in tension",
            ),
            Column::new("syy", "stress", "likewise"),
            Column::new("sxy", "stress", "likewise"),
            Column::new(
                "work",
                "force",
                "work of the stresses on the strains since the initial state, per thickness: what was put into the body",
            ),
            Column::new(
                "released",
                "force",
                "work of the unbalanced forces between iterates since the initial state, likewise: what instabilities set free and what steps overshot",
            ),
            Column::new(
                "damped",
                "force",
                "the part of `released` that the overdamped motion did",
            ),
            Column::new(
                "residual",
                "",
                "unbalanced force over the reactions (or external forces)",
            ),
            Column::new(
                "loose",
                "",
                "1 where the residual is within the loose tolerance only",
            ),
            Column::new(
                "iterations",
                "",
                "Newton iterations of the attempt that succeeded",
            ),
            Column::new("cuts", "", "attempts that failed before it"),
            Column::new(
                "cpu_s",
                "s",
                "CPU time of the step; a measurement, other than the rest of the row",
            ),
        ]);
        let mut table = Table::new(columns);
        table.title = vec![
            format!("run {}", run.name()),
            "units: those of the input; plane strain, per unit thickness".to_owned(),
            format!(
                "material in the field files: {}",
                legend(&results.material_names)
            ),
            format!(
                "region in the field files: {}",
                legend(&results.model.problem.mesh().region_names)
            ),
        ];
        Self {
            results,
            run,
            places,
            cavities,
            initial_volume: f64::NAN,
            counted: 0,
            energy: Energy::default(),
            table,
        }
    }

    /// Adds a step.
    pub fn push(&mut self, step: &StepView, state: &MacroState<2>) -> Result<(), ExportError> {
        let (input, summary) = (&self.run.manifest.problem, &step.summary);
        let problem = &self.results.model.problem;
        let mut row = place_values(&input.programme, input.loads.len(), step);
        for (_, target) in &self.places {
            row.extend(post::boundary_mean_displacement(
                problem,
                target,
                &state.displacement,
            ));
            row.extend(post::boundary_force(problem, target, &state.reactions));
        }
        let cavities = self.cavities.iter();
        row.extend(cavities.map(|cavity| cavity.expansion(&state.coordinates)));
        let volumes = |coordinates: &[f64]| {
            let volumes = problem.gauss_point_volumes(coordinates);
            volumes.map_err(|error| RunError::State(error.to_string()))
        };
        let volumes_now = volumes(&state.coordinates)?;
        let volume: f64 = volumes_now.iter().sum();
        if self.initial_volume.is_nan() {
            self.initial_volume = volumes(problem.initial())?.iter().sum();
        }
        row.extend([volume, volume / self.initial_volume - 1.0]);
        let mut stress = [0.0; 3];
        for (point, weight) in problem.gauss_points().zip(&volumes_now) {
            let s = state.stress_at(point);
            for (sum, component) in
                stress
                    .iter_mut()
                    .zip([s[0][0], s[1][1], 0.5 * (s[0][1] + s[1][0])])
            {
                *sum += weight * component;
            }
        }
        row.extend(stress.map(|sum| sum / volume));
        self.count_up_to(step.record.index.0);
        row.extend([self.energy.work, self.energy.released, self.energy.damped]);
        row.extend([
            summary.residual,
            f64::from(u8::from(summary.loosely_accepted)),
            summary.sweeps.len() as f64,
            f64::from(summary.cuts),
            step.cpu_s(),
        ]);
        Ok(self.table.push(row)?)
    }

    /// Adds the work of all steps up to this one; NaN behind one whose figures cannot be read.
    fn count_up_to(&mut self, last: u32) {
        const UNKNOWN: Energy = Energy {
            work: f64::NAN,
            exchanged: f64::NAN,
            released: f64::NAN,
            damped: f64::NAN,
        };
        let left = &self.run.steps[self.counted..];
        for step in left.iter().take_while(|step| step.record.index.0 <= last) {
            let is_known = step.record.index.0 == 0 || step.summary.increment > 0;
            let own = match is_known {
                true => Energy::of(&step.summary),
                false => UNKNOWN,
            };
            self.energy = self.energy.plus(own);
            self.counted += 1;
        }
    }

    /// The table.
    pub fn finish(self) -> Table {
        self.table
    }
}

/// `0 = sand, 1 = weak_sand`.
fn legend(names: &[String]) -> String {
    let pairs: Vec<String> = names
        .iter()
        .enumerate()
        .map(|(k, name)| format!("{k} = {name}"))
        .collect();
    pairs.join(", ")
}
