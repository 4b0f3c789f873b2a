//! What increments will cost, judged by those that are recorded.

use serde::Serialize;

use super::view::{RunView, StepView};
use crate::input::{
    Problem,
    problem::{Law, Material, Model, Origin},
};

/// Recorded steps that a pace is taken from: later steps cost more than early ones, so only the last ones count.
const RECENT: usize = 6;

/// Bytes of a stored state per grain: positions and contacts of 400 grains take 20 kB (docs/design/store.md).
const BYTES_PER_GRAIN: f64 = 50.0;
/// Bytes of what a step stores for each Gauss point besides: macro state, index of the pack.
const BYTES_PER_POINT: f64 = 300.0;

/// What one increment of a programme costs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pace {
    /// CPU seconds, all threads together; `None` where nothing like it was computed.
    pub cpu_s: Option<f64>,
    /// Wall seconds times threads over CPU seconds: what idles is counted here, 1 where no thread ever waits.
    pub idling: f64,
    /// Bytes of its packs.
    pub bytes: f64,
    /// What it was judged by, in words.
    pub judged_by: String,
}

/// CPU seconds and bytes of the steps of `run` after step `after`, and the increments they cover.
pub fn recorded(run: &RunView, after: u32) -> (f64, f64, f64) {
    let reached_at = |step: Option<&StepView>| step.map_or(0.0, StepView::reached);
    let start = run.steps.iter().rfind(|step| step.record.index.0 <= after);
    let later = run.steps.iter().filter(|step| step.record.index.0 > after);
    let cpu = later.map(StepView::cpu_s).sum();
    let covered = reached_at(run.last()) - reached_at(start);
    (
        cpu,
        bytes_per_increment(run, after, u32::MAX) * covered,
        covered,
    )
}

/// Bytes of the packs per increment of the steps of `run` after step `after` up to step `until`; where none of them has
/// its pack still, by those before. Pruned steps are passed over: as they were computed, they had packs like the others.
fn bytes_per_increment(run: &RunView, after: u32, until: u32) -> f64 {
    let steps: Vec<&StepView> = run
        .steps
        .iter()
        .filter(|step| step.record.index.0 <= until)
        .collect();
    let sized: Vec<(u32, f64, f64)> = steps
        .windows(2)
        .filter(|pair| pair[1].record.is_sound())
        .map(|pair| {
            let increments = pair[1].reached() - pair[0].reached();
            let record = &pair[1].record;
            (record.index.0, record.bytes as f64, increments)
        })
        .collect();
    let first = sized.partition_point(|(step, ..)| *step <= after);
    let chosen = match &sized[first..] {
        [] => &sized[sized.len().saturating_sub(RECENT)..],
        later => later,
    };
    let (bytes, increments) = chosen
        .iter()
        .fold((0.0, 0.0), |sum, (_, bytes, increments)| {
            (sum.0 + bytes, sum.1 + increments)
        });
    if increments > 0.0 {
        bytes / increments
    } else {
        0.0
    }
}

/// The pace of the steps of `run` up to step `until`; `None` where it has none.
pub fn pace(run: &RunView, until: u32) -> Option<Pace> {
    let steps: Vec<&StepView> = run
        .steps
        .iter()
        .filter(|step| step.record.index.0 <= until)
        .collect();
    let recent = &steps[steps.len().saturating_sub(RECENT + 1)..];
    let (first, later) = recent.split_first()?;
    let increments = later.last()?.reached() - first.reached();
    if increments <= 0.0 {
        return None;
    }
    let sum = |of: fn(&StepView) -> f64| later.iter().map(|step| of(step)).sum::<f64>();
    let cpu = sum(StepView::cpu_s);
    let wall = sum(|step| step.summary.wall_s);
    let threads = run.manifest.threads as f64;
    Some(Pace {
        cpu_s: Some(cpu / increments),
        idling: if cpu > 0.0 {
            (wall * threads / cpu).max(1.0)
        } else {
            1.0
        },
        bytes: bytes_per_increment(run, first.record.index.0, until),
        judged_by: format!("the last steps of `{}`", run.name()),
    })
}

/// The pace of the run in `runs` that is most like `problem`, brought to its size; without one only its disk space can
/// be told.
pub fn pace_like(problem: &Problem, runs: &[RunView]) -> Pace {
    let size = size(problem);
    let distance = |run: &RunView| {
        (self::size(&run.manifest.problem).grains / size.grains)
            .ln()
            .abs()
    };
    let candidates = runs
        .iter()
        .filter_map(|run| Some((run, pace(run, u32::MAX)?)))
        .filter(|(run, _)| self::size(&run.manifest.problem).grains_only == size.grains_only);
    let nearest = candidates.min_by(|(a, _), (b, _)| distance(a).total_cmp(&distance(b)));
    match nearest {
        Some((run, pace)) => {
            let scale = size.grains / self::size(&run.manifest.problem).grains;
            let scaled = match scale {
                1.0 => String::new(),
                _ => format!(", which has {:.3} of its grains", 1.0 / scale),
            };
            Pace {
                cpu_s: pace.cpu_s.map(|cpu| cpu * scale),
                bytes: pace.bytes * scale,
                judged_by: format!("{}{scaled}", pace.judged_by),
                ..pace
            }
        }
        None => Pace {
            cpu_s: None,
            idling: 1.0,
            bytes: size.grains * BYTES_PER_GRAIN * f64::from(u8::from(size.grains_only))
                + size.points * BYTES_PER_POINT,
            judged_by: "the size of its states; no run like it is in the store".to_owned(),
        },
    }
}

/// How large a problem is.
struct Size {
    points: f64,
    /// Grains of all Gauss points; a point without grains counts as one.
    grains: f64,
    /// Whether there are grains at all.
    grains_only: bool,
}

fn size(problem: &Problem) -> Size {
    let grains = |material: &Material| match &material.law {
        Law::Rev(rev) => match &rev.origin {
            Origin::Prepared(preparation) => f64::from(preparation.grains),
            // How many it has is in its file; most have so many.
            _ => 400.0,
        },
        Law::Elastic(_) => 1.0,
    };
    let (points, material) = match &problem.model {
        Model::ElementTest(test) => (1.0, test.material),
        Model::Body(body) => (body.mesh.point_count() as f64, body.material),
    };
    let each = problem.materials.get(material).map_or(1.0, grains);
    Size {
        points,
        grains: points * each,
        grains_only: each > 1.0,
    }
}
