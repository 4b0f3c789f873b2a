//! Packings from and for other programs.

use std::path::Path;

use serde_json::{Value, json};
use solver_dem::{
    LossOfConfinement, Settings, anatomy, exchange::PackingRecord, respond, settle, tensor,
};

use super::{Context, load, open::explain, packings::read_record, point::PointState, view::View};
use crate::{
    address::RevAddress,
    failure::{Failure, FailureKind},
    input::problem::{Law, Model, Problem},
    output::write_text,
    report::Report,
};

/// Reads a packing of another program and reports how good it is: as it stands, at rest in its cell, and settled under
/// the stress that its file names.
pub fn import(path: &Path) -> Result<Report, Failure> {
    let failed = |error| explain("import the packing", error);
    let name = path.display().to_string();
    let (record, rev) = read_record(&name).map_err(failed)?;
    // Without a list of contacts the tangential forces are not known, and the residual would mean nothing.
    let unbalance = (!record.contacts_list.is_empty())
        .then(|| anatomy(&rev).ok())
        .flatten()
        .map(|anatomy| anatomy.residual);
    let settings = Settings {
        loss_of_confinement: LossOfConfinement::Allow,
        ..Settings::default()
    };
    let at_rest = respond(&rev, None, &tensor::identity(), &settings).map_err(|error| {
        Failure::new(
            FailureKind::Run,
            format!("failed to bring {name} to equilibrium"),
        )
        .because(error)
    })?;
    let rest = super::point::with_state(&rev, at_rest.state.clone());
    let [[xx, xy], [_, yy]] = at_rest.stress;
    let mut text = format!(
        "{name}: {} grains, {} contacts in the file, void ratio {:.5}\n",
        rev.grains.radii.len(),
        rev.state.contacts.len(),
        rev.void_ratio()
    );
    if let Some(residual) = unbalance {
        text.push_str(&format!("  as it stands        residual {residual:.2e} (largest unbalanced force over the mean contact force)\n"));
    }
    text.push_str(&format!(
        "  at rest in its cell residual {:.2e} after {} cycles, σxx {xx:+.6}, σyy {yy:+.6}, σxy {xy:+.6}, coordination {:.3}, {} rattlers\n",
        at_rest.report.residual, at_rest.report.cycles, rest.coordination(), rest.rattlers()
    ));
    let settled = match settle(&rev, record.sigma0) {
        Ok((_, quality)) => {
            text.push_str(&format!(
                "  under σ0 = {:<8} residual {:.2e} after {} cycles, stress error {:.1e}, void ratio {:.5}, coordination {:.3}, {} rattlers\n",
                record.sigma0, quality.residual, quality.cycles, quality.stress_error, quality.void_ratio, quality.coordination, quality.rattlers
            ));
            json!(quality)
        }
        Err(error) => {
            text.push_str(&format!(
                "  under σ0 = {:<8} failed to settle: {error}\n",
                record.sigma0
            ));
            json!({ "error": error.to_string() })
        }
    };
    text.push_str(&format!(
        "A material takes it by `rev: {{ import: {name} }}`.\n"
    ));
    let data = json!({
        "file": name,
        "grains": rev.grains.radii.len(),
        "contacts": rev.state.contacts.len(),
        "void_ratio": rev.void_ratio(),
        "residual_as_it_stands": unbalance,
        "at_rest": {
            "stress": at_rest.stress,
            "report": at_rest.report,
            "coordination": rest.coordination(),
            "rattlers": rest.rattlers(),
            "void_ratio": rest.void_ratio(),
        },
        "sigma0": record.sigma0,
        "settled": settled,
    });
    Ok(Report::new(text, &data))
}

/// Writes the packing of one REV of a committed step to the file `into`.
pub fn export(context: &Context<'_>, rev: &RevAddress, into: &Path) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let run = view.run(&rev.run)?;
    let step = run.step(rev.step)?;
    let index = step.record.index;
    // Under the laws of the run that committed it: one that takes the step up may have others.
    let states = load::states(&view.store, &step.record.run, index)
        .map_err(|error| explain(&format!("read {}@{index}", run.name()), error))?;
    let problem = &run.manifest.problem;
    let per_element = match problem.model {
        Model::Body(_) => super::show::POINTS_PER_ELEMENT as usize,
        Model::ElementTest(_) => 1,
    };
    let (element, local) = (rev.place.element as usize, rev.place.point as usize);
    let usage = |why: String| {
        Failure::new(
            FailureKind::Usage,
            format!("failed to export the REV {rev}: {why}"),
        )
    };
    let state = (local < per_element)
        .then(|| states.get(element * per_element + local))
        .flatten();
    let Some(state) = state else {
        let last = (states.len() / per_element).saturating_sub(1);
        return Err(usage("it is not in the mesh".to_owned())
            .hint(format!("its REVs are e0.0 to e{last}.{}", per_element - 1)));
    };
    let PointState::Rev(packing) = &**state else {
        return Err(usage("that point is elastic, it has no grains".to_owned()));
    };
    let sigma0 = confining_stress(problem, element);
    let record = PackingRecord::from_rev(packing, sigma0);
    let text = serde_json::to_string_pretty(&record).map_err(|error| usage(error.to_string()))?;
    write_text(into, &text).map_err(|error| {
        Failure::new(FailureKind::Run, format!("failed to export the REV {rev}")).because(error)
    })?;
    let data: Value = json!({
        "rev": rev.to_string(),
        "step": index.0,
        "file": into.display().to_string(),
        "grains": packing.grains.radii.len(),
        "contacts": packing.state.contacts.len(),
        "void_ratio": packing.void_ratio(),
        "coordination": packing.coordination(),
    });
    let text = format!(
        "REV {}@{index}:{} written to {}: {} grains, {} contacts, void ratio {:.5}",
        run.name(),
        rev.place,
        into.display(),
        packing.grains.radii.len(),
        packing.state.contacts.len(),
        packing.void_ratio()
    );
    Ok(Report::new(text, &data))
}

/// σ0 of the material of an element.
fn confining_stress(problem: &Problem, element: usize) -> f64 {
    let material = match &problem.model {
        Model::ElementTest(test) => Some(test.material),
        Model::Body(body) => super::model::Model::new(body, problem.loads.len())
            .ok()
            .and_then(|model| model.materials.get(element).copied()),
    };
    match material
        .and_then(|k| problem.materials.get(k))
        .map(|material| &material.law)
    {
        Some(Law::Rev(rev)) => rev.confining_stress,
        _ => 1.0,
    }
}
