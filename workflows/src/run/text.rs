//! Sizes, times and tables as people read them.

use std::fmt::Write as _;

/// A number of bytes with a decimal prefix: `7.0 MB`.
pub fn bytes(count: u64) -> String {
    const PREFIXES: [&str; 6] = ["kB", "MB", "GB", "TB", "PB", "EB"];
    if count < 1000 {
        return format!("{count} B");
    }
    let mut value = count as f64;
    let mut prefix = "";
    for next in PREFIXES {
        if value < 999.95 {
            break;
        }
        value /= 1000.0;
        prefix = next;
    }
    format!("{value:.1} {prefix}")
}

/// A number of things: `1 packing`, `2 packings`.
pub fn count(number: usize, thing: &str) -> String {
    let ending = if number == 1 { "" } else { "s" };
    format!("{number} {thing}{ending}")
}

/// A duration in the two largest units that matter: `12.3 s`, `7 min 05 s`, `3 h 20 min`, `4 d 07 h`.
pub fn duration(seconds: f64) -> String {
    if !seconds.is_finite() {
        return "?".to_owned();
    }
    let seconds = seconds.max(0.0);
    if seconds < 99.95 {
        return format!("{seconds:.1} s");
    }
    let whole = seconds.round() as u64;
    let (minutes, hours, days) = (whole / 60, whole / 3600, whole / 86_400);
    match () {
        () if days > 0 => format!("{days} d {:02} h", hours % 24),
        () if hours > 0 => format!("{hours} h {:02} min", minutes % 60),
        () => format!("{minutes} min {:02} s", whole % 60),
    }
}

/// Seconds since 1970 as date and time in UTC: `2026-11-22 10:37`.
///
/// Days to civil date: Hinnant, "chrono-compatible low-level date algorithms" (2013), `civil_from_days`.
pub fn utc(unix: u64) -> String {
    let (days, second) = (unix / 86_400, unix % 86_400);
    // Years begin in March here, so that the leap day is the last of its year.
    let shifted = days + 719_468;
    let (era, of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let march_month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * march_month + 2) / 5 + 1;
    let month = if march_month < 10 {
        march_month + 3
    } else {
        march_month - 9
    };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    format!(
        "{year}-{month:02}-{day:02} {:02}:{:02}",
        second / 3600,
        second % 3600 / 60
    )
}

/// On which side the cells of a column stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// A table in plain text: columns as wide as they need, two blanks between.
#[derive(Debug, Clone)]
pub struct Table {
    columns: Vec<(String, Align)>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table under these headings.
    pub fn new<'a>(columns: impl IntoIterator<Item = (&'a str, Align)>) -> Self {
        let columns = columns
            .into_iter()
            .map(|(name, align)| (name.to_owned(), align))
            .collect();
        Self {
            columns,
            rows: Vec::new(),
        }
    }

    /// Adds a row; cells that are missing stay empty, those without a heading are dropped.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        let mut cells: Vec<String> = cells.into_iter().collect();
        cells.resize(self.columns.len(), String::new());
        self.rows.push(cells);
    }

    /// The table as lines, each behind `indent`; columns without any content are left out.
    pub fn render(&self, indent: &str) -> String {
        let shown: Vec<usize> = (0..self.columns.len())
            .filter(|&k| self.rows.is_empty() || self.rows.iter().any(|row| !row[k].is_empty()))
            .collect();
        let width = |k: usize| {
            let cells = self.rows.iter().map(|row| row[k].chars().count());
            cells
                .max()
                .unwrap_or(0)
                .max(self.columns[k].0.chars().count())
        };
        let widths: Vec<usize> = shown.iter().map(|&k| width(k)).collect();
        let headings: Vec<String> = self.columns.iter().map(|(name, _)| name.clone()).collect();
        let mut text = String::new();
        for cells in std::iter::once(&headings).chain(&self.rows) {
            let mut line = indent.to_owned();
            for (&k, &width) in shown.iter().zip(&widths) {
                let cell = &cells[k];
                let written = match self.columns[k].1 {
                    Align::Left => write!(line, "{cell:<width$}  "),
                    Align::Right => write!(line, "{cell:>width$}  "),
                };
                written.expect("a String takes everything");
            }
            text.push_str(line.trim_end());
            text.push('\n');
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_hold_across_leap_days_and_centuries() {
        assert_eq!(utc(0), "1970-01-01 00:00");
        assert_eq!(utc(951_782_399), "2000-02-28 23:59");
        assert_eq!(utc(951_782_400), "2000-02-29 00:00");
        assert_eq!(utc(4_107_542_400), "2100-03-01 00:00");
        assert_eq!(utc(1_795_343_852), "2026-11-22 10:37");
    }

    #[test]
    fn sizes_and_times_keep_to_the_units_that_matter() {
        assert_eq!(
            [bytes(999), bytes(1000), bytes(999_960)],
            ["999 B", "1.0 kB", "1.0 MB"]
        );
        assert_eq!([duration(12.34), duration(99.97)], ["12.3 s", "1 min 40 s"]);
        assert_eq!(
            [duration(12_000.0), duration(370_000.0)],
            ["3 h 20 min", "4 d 06 h"]
        );
        assert_eq!([duration(f64::NAN), duration(-1.0)], ["?", "0.0 s"]);
    }

    #[test]
    fn a_table_aligns_what_it_shows_and_hides_what_is_empty() {
        let mut table = Table::new([
            ("run", Align::Left),
            ("note", Align::Left),
            ("steps", Align::Right),
        ]);
        table.row(["σ".to_owned(), String::new(), "7".to_owned()]);
        table.row(["hollow".to_owned(), String::new(), "12".to_owned()]);
        assert_eq!(
            table.render(""),
            "run     steps\nσ           7\nhollow     12\n"
        );
    }
}
