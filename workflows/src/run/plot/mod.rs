//! `plot`: pictures of a run, straight from its committed steps: quantities on the mesh, curves of the whole body.

mod cells;
mod curve;
mod map;
mod quantity;

use std::str::FromStr;

use serde_json::json;

pub use self::cells::Spread;
use self::curve::{Axis, Line};
use self::map::{Frame, Words};
pub use self::quantity::Quantity;
use self::quantity::{Snapshot, Values};
use super::{
    Context, export, list, text,
    view::{RunView, StepView, View},
};
use crate::{
    address::{PlotAddress, StepSpan},
    failure::{Failure, FailureKind},
    input::problem::Model as InputModel,
    plot::{PictureFile, Range, Scene},
    report::Report,
};

/// Two columns of the curves: along x, along y.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CurveAxes([Axis; 2]);

impl FromStr for CurveAxes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Option<Vec<Axis>> = text.split(',').map(Axis::parse).collect();
        match parts.and_then(|parts| <[Axis; 2]>::try_from(parts).ok()) {
            Some(axes) => Ok(Self(axes)),
            None => Err("write two columns, as in `-uy_top,-fy_top`".to_owned()),
        }
    }
}

/// The numbers that colours span, `0,12.5`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourRange(Range);

impl FromStr for ColourRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |part: &str| part.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let ends = text.split_once(',').and_then(|(low, high)| {
            let (low, high) = (number(low)?, number(high)?);
            (low < high).then_some(Range { low, high })
        });
        ends.map(Self)
            .ok_or_else(|| "write the least and the greatest number, as in `0,12.5`".to_owned())
    }
}

/// The part of a body that is drawn, from one corner to the opposite one: `0,0,3,2.5`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    low: [f64; 2],
    high: [f64; 2],
}

impl FromStr for Window {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Option<Vec<f64>> = text
            .split(',')
            .map(|part| part.trim().parse::<f64>().ok().filter(|x| x.is_finite()))
            .collect();
        match numbers.as_deref() {
            Some(&[x0, y0, x1, y1]) if x0 != x1 && y0 != y1 => Ok(Self {
                low: [x0.min(x1), y0.min(y1)],
                high: [x0.max(x1), y0.max(y1)],
            }),
            _ => Err("write two opposite corners, as in `0,0,3,2.5`".to_owned()),
        }
    }
}

/// How a quantity is drawn on the mesh.
#[derive(Debug, Clone, Copy)]
pub struct MapStyle {
    /// What is drawn.
    pub quantity: Quantity,
    /// How values at Gauss points are spread.
    pub spread: Spread,
    /// Displacements are drawn this many times as large as they are.
    pub deformed: f64,
    /// What the colours span; the values themselves where it is not given.
    pub range: Option<ColourRange>,
    /// The part that is drawn; all where it is not given.
    pub window: Option<Window>,
}

/// Draws a quantity on the mesh of a run.
pub fn map(
    context: &Context<'_>,
    address: &PlotAddress,
    style: &MapStyle,
    output: Option<&PictureFile>,
) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let run = view.run(&address.run)?;
    let InputModel::Body(body) = &run.manifest.problem.model else {
        let what = format!(
            "failed to draw run `{}`: an element test has no mesh",
            run.name()
        );
        return Err(Failure::new(FailureKind::Usage, what).hint(
            "`--curve exx,stress_ratio` draws its curves; `femdem-flow rev show` draws the grains",
        ));
    };
    let (from, step) = steps(&run, address.steps)?;
    let unreadable =
        |error: export::ExportError| error.explain(&format!("draw run `{}`", run.name()));
    let results = export::BodyResults::open(&view, &run, body).map_err(unreadable)?;
    let snapshot = |step: &StepView| -> Result<Snapshot, Failure> {
        Ok(Snapshot {
            state: results.state(step).map_err(unreadable)?,
            points: results.points(step).map_err(unreadable)?,
            cost: results.cost(step).map_err(unreadable)?,
        })
    };
    let now = snapshot(step)?;
    let before = from.map(snapshot).transpose()?;
    let quantity = style.quantity;
    let values = quantity.values(&results.model, &now, before.as_ref());
    let problem = &results.model.problem;
    let initial = problem.initial();
    let positions: Vec<f64> = initial
        .iter()
        .zip(&now.state.coordinates)
        .map(|(start, x)| start + style.deformed * (x - start))
        .collect();
    let outlined = (style.deformed != 0.0).then_some(initial);
    let frame = match style.window {
        Some(window) => Frame::between(window.low, window.high),
        None => Frame::around([Some(positions.as_slice()), outlined].into_iter().flatten()),
    };
    let elements = frame.elements(problem, &positions);
    if elements == 0 {
        let what = format!(
            "failed to draw run `{}`: there is nothing in the window",
            run.name()
        );
        return Err(Failure::new(FailureKind::Usage, what)
            .hint("`--window` takes coordinates of the mesh, `--deformed` as drawn"));
    }
    // Cells of about three units look smooth.
    let side = frame.side(elements) / 3.0;
    let mut cells = cells::cells(problem, &positions, &values, style.spread, side);
    cells.retain(|cell| frame.shows(cell.corners.iter().copied()));
    let (least, greatest) = extremes(cells.iter().map(|cell| cell.value));
    let scale = quantity.scale(from.is_some());
    let range = style
        .range
        .map_or_else(|| map::range(scale, least, greatest), |range| range.0);
    let span = match from {
        None => step.record.index.to_string(),
        Some(from) => format!("{}..{}", from.record.index, step.record.index),
    };
    let words = Words {
        title: format!("{}@{span}", run.name()),
        subtitle: subtitle(&run, step, style.deformed),
        label: quantity.label(from.is_some()),
    };
    let scene = map::draw(
        problem,
        &frame,
        &cells,
        &positions,
        outlined,
        (scale, range),
        &words,
    );
    let stem = format!(
        "{}-{}-{}",
        run.name(),
        span.replace("..", "-"),
        quantity.name()
    );
    let file = write(&scene, output, &stem)?;
    // It may lie outside of a window.
    let place = match style.window {
        None => greatest_at(&values, problem.points_per_element()),
        Some(_) => None,
    };
    let text = format!(
        "{} of `{}`: drawn from {least:.4} to {greatest:.4}{}\nDrawn to {file}.\n",
        quantity.name(),
        words.title,
        place.as_ref().map_or(String::new(), |place| format!(
            "; greatest as computed at {place}"
        )),
    );
    let data = json!({
        "run": run.name().as_str(),
        "step": step.record.index.0,
        "since": from.map(|step| step.record.index.0),
        "field": quantity.name(),
        "least": least,
        "greatest": greatest,
        "greatest_at": place,
        "colours": [range.low, range.high],
        "file": file.path(),
    });
    Ok(Report::new(text, &data))
}

/// The step to draw and, where two are named, the earlier one.
fn steps(run: &RunView, span: StepSpan) -> Result<(Option<&StepView>, &StepView), Failure> {
    let last = || {
        let none = || {
            let what = format!(
                "failed to draw run `{}`: no load step is committed yet",
                run.name()
            );
            Failure::new(FailureKind::Run, what)
        };
        run.last().ok_or_else(none)
    };
    match span {
        StepSpan::Whole => Ok((None, last()?)),
        StepSpan::At(step) => Ok((None, run.step(step)?)),
        StepSpan::Between(from, to) => {
            let (from, to) = (run.step(from)?, run.step(to)?);
            if from.record.index >= to.record.index {
                let what = format!(
                    "failed to draw run `{}`: step {} is not before step {}",
                    run.name(),
                    from.record.index,
                    to.record.index
                );
                return Err(Failure::new(FailureKind::Usage, what)
                    .hint("write the earlier step first, as in `hollow@12..20`"));
            }
            Ok((Some(from), to))
        }
    }
}

fn extremes(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    let (least, greatest) = values
        .filter(|value| value.is_finite())
        .fold(start, |(low, high), value| {
            (low.min(value), high.max(value))
        });
    match least <= greatest {
        true => (least, greatest),
        false => (0.0, 0.0),
    }
}

/// Where the greatest value is: a Gauss point or an element; nothing for nodes, which have no address.
fn greatest_at(values: &Values, per_element: usize) -> Option<String> {
    let place = |values: &[f64]| {
        let known = (0..values.len()).filter(|&k| values[k].is_finite());
        // The first of equals.
        known.reduce(|best, k| if values[k] > values[best] { k } else { best })
    };
    match values {
        Values::Nodes(_) => None,
        Values::Points(values) => {
            let point = place(values)?;
            Some(format!("e{}.{}", point / per_element, point % per_element))
        }
        Values::Elements(values) => Some(format!("e{}", place(values)?)),
    }
}

/// `increment 20 of 40, stage compression, shortening −0.04; displacements × 1`.
fn subtitle(run: &RunView, step: &StepView, deformed: f64) -> String {
    let summary = &step.summary;
    let mut parts = Vec::new();
    if summary.increment > 0 {
        let (done, of) = (list::increments(step.reached()), run.increments().1);
        parts.push(format!("increment {done} of {of}"));
    } else {
        parts.push("initial state".to_owned());
    }
    if !summary.stage.is_empty() {
        parts.push(summary.stage.clone());
    }
    for (name, value) in run.manifest.problem.loads.iter().zip(&summary.loads) {
        parts.push(format!(
            "{name} {}",
            crate::plot::minus(&format!("{value:.4}"))
        ));
    }
    if deformed != 1.0 {
        parts.push(format!("displacements × {deformed}"));
    }
    parts.join(", ")
}

/// Draws one column of the curves of runs over another.
pub fn curve(
    context: &Context<'_>,
    addresses: &[PlotAddress],
    axes: &CurveAxes,
    output: Option<&PictureFile>,
) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let (mut lines, mut gaps) = (Vec::new(), Vec::new());
    for address in addresses {
        let run = view.run(&address.run)?;
        let (from, to) = match address.steps {
            StepSpan::Whole => (None, None),
            span => {
                let (from, to) = steps(&run, span)?;
                (
                    from.map(|step| step.record.index.0),
                    Some(to.record.index.0),
                )
            }
        };
        let mut left_out = export::LeftOut::default();
        let table = export::table(&view, &run, &mut left_out)
            .map_err(|error| error.explain(&format!("draw run `{}`", run.name())))?;
        let is_wanted = |step: f64| {
            from.is_none_or(|from| step >= f64::from(from))
                && to.is_none_or(|to| step <= f64::from(to))
        };
        let table = table.filtered(|row| row.first().is_some_and(|step| is_wanted(*step)));
        let mut columns = [0; 2];
        for (place, axis) in columns.iter_mut().zip(&axes.0) {
            *place = axis.find(table.columns()).ok_or_else(|| {
                let names: Vec<&str> = table.columns().iter().map(|c| c.name.as_str()).collect();
                let what = format!("run `{}` has no curve `{}`", run.name(), axis.column);
                Failure::new(FailureKind::Usage, what).hint(format!("it has {}", names.join(", ")))
            })?;
        }
        gaps.push((run.name().clone(), left_out));
        let name = address.to_string();
        lines.push(Line {
            name,
            table,
            columns,
        });
    }
    let scene = curve::draw(&axes.0, &lines);
    let first = addresses
        .first()
        .map_or("run", |address| address.run.as_str());
    let stem = format!("{first}-{}-{}", axes.0[1].column, axes.0[0].column);
    let file = write(&scene, output, &stem)?;
    let text = format!(
        "{} over {} of {}.\nDrawn to {file}.\n",
        axes.0[1].column,
        axes.0[0].column,
        text::count(lines.len(), "run"),
    );
    let data = json!({
        "x": axes.0[0].column,
        "y": axes.0[1].column,
        "runs": addresses.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "points": lines.iter().map(|line| line.table.rows().len()).collect::<Vec<_>>(),
        "file": file.path(),
    });
    let report = Report::new(text, &data);
    gaps.iter().try_fold(report, |report, (run, left_out)| {
        left_out.conclude(run, context.progress, report)
    })
}

/// Writes the picture where it is wanted, by default as a PNG named `stem` in the working directory.
fn write(scene: &Scene, output: Option<&PictureFile>, stem: &str) -> Result<PictureFile, Failure> {
    let file = match output {
        Some(output) => output.clone(),
        None => format!("{stem}.png").parse().map_err(|error| {
            Failure::new(FailureKind::Usage, "failed to name the picture")
                .because(error)
                .hint("name it by `--output FILE.png`")
        })?,
    };
    file.write(scene).map_err(|error| {
        Failure::new(FailureKind::Run, "failed to draw the picture")
            .because(error)
            .hint("`--output FILE` draws it elsewhere")
    })?;
    Ok(file)
}
