//! Curves of global quantities, of one run or of several in one picture.

use crate::{
    output::csv::{Column, Table},
    plot::{
        Axes, Colour, Curve, Paint, Range, Scene, Text,
        palette::{BLUE, GREEN, INK, ORANGE, PURPLE, SKY, VERMILION},
    },
};

const PAGE_WIDTH: f64 = 620.0;
const PANEL: [f64; 2] = [490.0, 350.0];
const LEFT: f64 = 96.0;
const TOP: f64 = 26.0;
/// Height of a line of the legend.
const LINE: f64 = 18.0;
/// Room below the panel for numbers and the label.
const BELOW: f64 = 58.0;

/// Colours of the runs, one after the other; from the eighth on they come again.
const COLOURS: [Colour; 7] = [BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, INK];

/// A column of the curves of a run, as it is or with its sign turned round.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Axis {
    /// Name of the column.
    pub column: String,
    /// `−` turns compression into a positive number.
    pub sign: Sign,
}

/// Whether a column is drawn as it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// As it is.
    Kept,
    /// With the other sign.
    Turned,
}

impl Axis {
    /// `uy_top` or `-uy_top`.
    pub fn parse(text: &str) -> Option<Self> {
        let (sign, column) = match text.trim().strip_prefix('-') {
            Some(column) => (Sign::Turned, column),
            None => (Sign::Kept, text.trim()),
        };
        (!column.is_empty()).then(|| Self {
            column: column.to_owned(),
            sign,
        })
    }

    /// Its place among `columns`.
    pub fn find(&self, columns: &[Column]) -> Option<usize> {
        columns.iter().position(|column| column.name == self.column)
    }

    fn label(&self, column: &Column) -> String {
        let sign = match self.sign {
            Sign::Kept => "",
            Sign::Turned => "−",
        };
        let unit = match column.unit.as_str() {
            "" => String::new(),
            unit => format!(" ({unit})"),
        };
        format!("{sign}{}{unit}", column.name)
    }

    fn value(&self, x: f64) -> f64 {
        match self.sign {
            Sign::Kept => x,
            Sign::Turned => -x,
        }
    }
}

/// A curve of one run.
pub struct Line {
    /// What the legend calls it.
    pub name: String,
    /// Its table, cut to the steps that are drawn.
    pub table: Table,
    /// The columns along x and y.
    pub columns: [usize; 2],
}

/// The picture of at least one curve.
pub fn draw(axes: &[Axis; 2], lines: &[Line]) -> Scene {
    let height = TOP + LINE * lines.len() as f64 + PANEL[1] + BELOW;
    let mut scene = Scene::new(PAGE_WIDTH, height);
    let points: Vec<Vec<[f64; 2]>> = lines
        .iter()
        .map(|line| {
            let rows = line.table.rows().iter();
            rows.map(|row| [0, 1].map(|k| axes[k].value(row[line.columns[k]])))
                .collect()
        })
        .collect();
    let range = |k: usize| Range::around(points.iter().flatten().map(|point| point[k]), 0.0);
    let panel = Axes {
        corner: [LEFT, TOP + LINE * lines.len() as f64],
        size: PANEL,
        x: range(0),
        y: range(1),
    };
    let label = |k: usize| {
        let line = lines.first();
        line.map_or_else(String::new, |line| {
            axes[k].label(&line.table.columns()[line.columns[k]])
        })
    };
    panel.draw(&mut scene, &label(1), Some(&label(0)), None);
    let colours = COLOURS.into_iter().cycle();
    for (number, ((line, points), colour)) in lines.iter().zip(points).zip(colours).enumerate() {
        panel.curve(&mut scene, &Curve { points, colour });
        let y = 22.0 + LINE * number as f64;
        scene.line(
            [LEFT, y - 4.5],
            [LEFT + 26.0, y - 4.5],
            &Paint::line(colour, 2.2),
        );
        scene.text([LEFT + 34.0, y], &Text::new(&line.name, 12.5));
    }
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_minus_turns_a_column_round_and_is_written_on_the_axis() {
        let axis = Axis::parse("-fy_top").unwrap();
        assert_eq!((axis.value(2.0), axis.column.as_str()), (-2.0, "fy_top"));
        let column = Column::new("fy_top", "force per thickness", "");
        assert_eq!(axis.label(&column), "−fy_top (force per thickness)");
        assert!(Axis::parse("-").is_none() && Axis::parse(" ").is_none());
    }
}
