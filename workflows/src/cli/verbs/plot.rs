//! `femdem-flow plot RUN[@STEP[..STEP]]…`

use crate::address::PlotAddress;
use crate::failure::{Failure, FailureKind};
use crate::plot::PictureFile;
use crate::report::Report;
use crate::run::{self, ColourRange, Context, CurveAxes, MapStyle, Quantity, Spread, Window};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The run, its last step where none is named, or what happened between two steps: `hollow`, `hollow@12`,
    /// `hollow@12..20`. Several for `--curve`.
    #[arg(value_name = "RUN[@STEP[..STEP]]", required = true)]
    addresses: Vec<PlotAddress>,
    /// The quantity that colours the mesh.
    #[arg(long, value_enum, value_name = "FIELD", default_value = "shear_strain")]
    field: Quantity,
    /// How values at Gauss points fill the mesh.
    #[arg(long, value_enum, value_name = "BY", default_value = "nodes")]
    by: Spread,
    /// Draw displacements this many times as large as they are; 0 draws the initial mesh.
    #[arg(
        long,
        value_name = "SCALE",
        default_value_t = 1.0,
        allow_negative_numbers = true
    )]
    deformed: f64,
    /// What the colours span, so that several pictures can be compared: `0,12.5`.
    #[arg(long, value_name = "LOW,HIGH", allow_hyphen_values = true)]
    range: Option<ColourRange>,
    /// Draw a part of the body only, between two opposite corners: `0,0,3,2.5`. Colours span what is seen.
    #[arg(long, value_name = "X0,Y0,X1,Y1", allow_hyphen_values = true)]
    window: Option<Window>,
    /// Draw a curve instead: two columns of `curves.csv`, along x and along y; `-` before a name turns its sign round:
    /// `-uy_top,-fy_top`.
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, conflicts_with_all = ["field", "by", "deformed", "range", "window"])]
    curve: Option<CurveAxes>,
    /// The picture, PNG or SVG by its extension; by default a PNG here, named after what it shows.
    #[arg(long, short, value_name = "FILE")]
    output: Option<PictureFile>,
}

pub fn perform(args: &Args, context: &Context<'_>) -> Result<Report, Failure> {
    let output = args.output.as_ref();
    if let Some(axes) = &args.curve {
        return run::plot_curve(context, &args.addresses, axes, output);
    }
    let [address] = args.addresses.as_slice() else {
        let what = "failed to draw several runs as one mesh";
        return Err(Failure::new(FailureKind::Usage, what).hint(
            "draw them one by one with the same `--range`, or their curves with `--curve X,Y`",
        ));
    };
    if !args.deformed.is_finite() {
        return Err(Failure::new(
            FailureKind::Usage,
            "`--deformed` takes a number",
        ));
    }
    let style = MapStyle {
        quantity: args.field,
        spread: args.by,
        deformed: args.deformed,
        range: args.range,
        window: args.window,
    };
    run::plot_map(context, address, &style, output)
}
