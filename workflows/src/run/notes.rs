//! What is right by the letter of the input and probably not meant. The user reads it once, before the run begins.

use solver_fem::assembly::{Configuration, Start, residual};

use super::{error::RunError, model::Model};
use crate::input::{
    Problem,
    problem::{Body, Condition, ConditionKind, Model as InputModel, Selection},
};

/// Unbalanced force of the initial state, over the reactions, above which something does not fit.
const UNBALANCED: f64 = 1e-3;

/// What the user should know about `problem`.
///
/// # Errors
/// The input does not make a model.
pub fn notes(problem: &Problem) -> Result<Vec<String>, RunError> {
    let InputModel::Body(body) = &problem.model else {
        return Ok(Vec::new());
    };
    let model = Model::new(body, problem.loads.len())?;
    model.check(&problem.programme)?;
    let mut notes = empty_regions(body, &model);
    notes.extend(unmoved(problem, body));
    notes.extend(out_of_balance(problem, body, &model)?);
    Ok(notes)
}

/// Displacements move by the change of their value: an initial value other than 0 is not gone through.
fn unmoved(problem: &Problem, body: &Body) -> Vec<String> {
    let note = |condition: &Condition| {
        let ConditionKind::Displacement { component, value } = condition.kind else {
            return None;
        };
        let (on, axis) = (&condition.on, ["x", "y"][component]);
        let initial = value.at(&problem.programme.initial);
        (initial != 0.0).then(|| {
            format!(
                "`{on}` does not begin with a displacement {axis} of {initial}: displacements move by the change of their value, from where the boundary is; drive it there by a load that begins with 0"
            )
        })
    };
    body.conditions.iter().filter_map(note).collect()
}

fn empty_regions(body: &Body, model: &Model) -> Vec<String> {
    let empty = |selection: &Selection| match selection {
        Selection::Elements(elements) => elements.is_empty(),
        Selection::Box(within) => model
            .problem
            .mesh()
            .elements_in_box(within.from, within.to)
            .is_empty(),
    };
    body.regions
        .iter()
        .filter(|region| empty(&region.selection))
        .map(|region| {
            format!(
                "region `{}` selects no element: no element centre lies in its box",
                region.name
            )
        })
        .collect()
}

/// The first load step has to bring a body whose initial stresses do not fit its loads into balance, which is seldom
/// what was meant.
fn out_of_balance(
    problem: &Problem,
    body: &Body,
    model: &Model,
) -> Result<Option<String>, RunError> {
    let per_element = model.problem.points_per_element();
    let initial = |element: &usize| problem.materials[*element].initial_stress();
    let stress: Vec<f64> = model
        .materials
        .iter()
        .map(initial)
        .flat_map(|p| std::iter::repeat_n([p, 0.0, 0.0, p], per_element).flatten())
        .collect();
    let loads = &problem.programme.initial;
    let mut unknowns = model.problem.initial().to_vec();
    unknowns.resize(model.problem.layout().len(), 0.0);
    let double_stress = vec![0.0; 8 * model.problem.gauss_point_count()];
    let at = Configuration {
        unknowns: &unknowns,
        stress: &stress,
        loads,
        start: Start {
            coordinates: model.problem.initial(),
            double_stress: &double_stress,
        },
    };
    let balance =
        residual(&model.problem, &at).map_err(|error| RunError::State(error.to_string()))?;
    let relative = balance.ratio(0.0);
    if relative.is_nan() || relative <= UNBALANCED {
        return Ok(None);
    }
    let mut note = format!(
        "the initial state is not in balance: the unbalanced force is {:.2} of the supports' or the loads'",
        relative
    );
    let weight = body.body_force.into_iter().flatten();
    if weight.into_iter().any(|value| value.at(loads) != 0.0) {
        note.push_str(
            "; the body force acts from the beginning: a load that begins at 0 would bring it up in steps",
        );
    }
    for mismatch in mismatches(problem, body, model) {
        note.push_str("; ");
        note.push_str(&mismatch);
    }
    Ok(Some(note))
}

/// Boundaries under a pressure that the material behind them is not in balance with.
fn mismatches(problem: &Problem, body: &Body, model: &Model) -> Vec<String> {
    let mut found = Vec::new();
    for condition in &body.conditions {
        let ConditionKind::Pressure(amount) = condition.kind else {
            continue;
        };
        let pressure = amount.at(&problem.programme.initial);
        let facets = model
            .problem
            .mesh()
            .boundaries
            .get(&condition.on)
            .into_iter()
            .flatten();
        let mut materials: Vec<usize> =
            facets.map(|facet| model.materials[facet.element]).collect();
        materials.sort_unstable();
        materials.dedup();
        for material in materials.into_iter().map(|k| &problem.materials[k]) {
            let stress = material.initial_stress();
            if (stress + pressure).abs() > UNBALANCED * pressure.abs().max(stress.abs()) {
                found.push(format!(
                    "`{}` begins at pressure {pressure}, material `{}` behind it at {}",
                    condition.on, material.name, -stress
                ));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(pressure: &str, region: &str) -> Vec<String> {
        let text = format!(
            "name: t\nmesh: {{ rectangle: {{ size: [1.0, 1.0], elements: [2, 2] }} }}\n\
             materials: {{ sand: {{ rev: {{}} }} }}\nmaterial: sand\nloads: {{ side: {pressure} }}\n\
             regions: [ {{ name: part, box: {{ from: {region}, to: [1, 1] }}, material: sand }} ]\n\
             boundary:\n  - {{ on: bottom, displacement: {{ y: 0 }} }}\n  - {{ on: left, displacement: {{ x: 0 }} }}\n  \
             - {{ on: top, pressure: 1 }}\n  - {{ on: right, pressure: side }}\n\
             programme: [ {{ name: a, ramp: {{ side: 2 }}, steps: 1 }} ]\n"
        );
        let problem = crate::input::parse(&text, "t.yaml", std::path::Path::new("."));
        notes(&problem.unwrap_or_else(|errors| panic!("{errors}"))).unwrap()
    }

    #[test]
    fn an_input_that_fits_is_passed_in_silence() {
        assert_eq!(of("1.0", "[0.5, 0]"), Vec::<String>::new());
    }

    #[test]
    fn a_pressure_forgotten_at_the_start_is_told_before_hours_are_spent() {
        let notes = of("0.5", "[0.5, 0]");
        assert_eq!(notes.len(), 1, "{notes:?}");
        let expected = "`right` begins at pressure 0.5, material `sand` behind it at 1";
        assert!(
            notes[0].contains("not in balance") && notes[0].contains(expected),
            "{notes:?}"
        );
        // `top` fits, so it is not blamed.
        assert!(!notes[0].contains("`top`"), "{notes:?}");
    }

    #[test]
    fn a_region_beside_all_element_centres_is_told() {
        let notes = of("1.0", "[0.9, 0.9]");
        assert!(
            notes.len() == 1 && notes[0].contains("`part` selects no element"),
            "{notes:?}"
        );
    }

    /// Grains begin under an even stress, which no weight is in balance with.
    #[test]
    fn a_weight_that_acts_from_the_beginning_is_told() {
        let text = "name: t\nmesh: { rectangle: { size: [1.0, 1.0], elements: [2, 2] } }\n\
                    materials: { sand: { rev: {} } }\nloads: { weight: -0.5 }\nbody_force: { y: weight }\n\
                    boundary:\n  - { on: bottom, displacement: { y: 0 } }\n  - { on: left, displacement: { x: 0 } }\n  \
                    - { on: top, pressure: 1 }\n  - { on: right, pressure: 1 }\n\
                    programme: [ { name: a, ramp: { weight: -1 }, steps: 1 } ]\n";
        let of = |text: &str| {
            let problem = crate::input::parse(text, "t.yaml", std::path::Path::new("."));
            notes(&problem.unwrap_or_else(|errors| panic!("{errors}"))).unwrap()
        };
        let told = of(text);
        assert!(
            told.len() == 1 && told[0].contains("the body force acts from the beginning"),
            "{told:?}"
        );
        assert_eq!(of(&text.replace("-0.5", "0")), Vec::<String>::new());
    }
}
