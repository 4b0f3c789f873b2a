//! Packings from and for other programs.

use std::path::Path;

use serde_json::{Value, json};
use solver_dem::{
    LossOfConfinement, Settings, anatomy, exchange::PackingRecord, respond, settle, tensor,
};

use super::{Context, open::explain, packings::read_record, rev_of_step};
use crate::{
    address::RevAddress,
    failure::{Failure, FailureKind},
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
    let found = rev_of_step::find(context, rev)?;
    let packing = &found.rev;
    let failed = || Failure::new(FailureKind::Run, format!("failed to export the REV {rev}"));
    let record = PackingRecord::from_rev(packing, found.confining_stress);
    let text = serde_json::to_string_pretty(&record).map_err(|error| failed().because(error))?;
    write_text(into, &text).map_err(|error| failed().because(error))?;
    let data: Value = json!({
        "rev": rev.to_string(),
        "step": found.step.0,
        "file": into.display().to_string(),
        "grains": packing.grains.radii.len(),
        "contacts": packing.state.contacts.len(),
        "void_ratio": packing.void_ratio(),
        "coordination": packing.coordination(),
    });
    let text = format!(
        "REV {}@{}:{} written to {}: {} grains, {} contacts, void ratio {:.5}",
        rev.run,
        found.step,
        rev.place,
        into.display(),
        packing.grains.radii.len(),
        packing.state.contacts.len(),
        packing.void_ratio()
    );
    Ok(Report::new(text, &data))
}
