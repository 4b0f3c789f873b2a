//! Labels with italics and subscripts: `*q*/*p*`, `*a*_{c} = 0.21`.

use std::fmt::Write as _;

/// Subscripts: size over that of the text, and how far they sink, over the same.
const SUB_SIZE: f64 = 0.72;
const SUB_DEPTH: f64 = 0.22;

/// Text as XML may hold it: marked characters escaped, control characters (which XML 1.0 has no way to write) as spaces.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            c if c.is_control() => escaped.push(' '),
            c => escaped.push(c),
        }
    }
    escaped
}

/// The label as SVG spans, for text of this `size`. `*…*` is italic, `_{…}` a subscript; a mark that is not closed
/// lasts to the end.
pub fn spans(label: &str, size: f64) -> String {
    let mut out = String::new();
    let mut run = String::new();
    let (mut italic, mut sunk, mut sinking) = (false, false, 0.0);
    let mut characters = label.chars().peekable();
    while let Some(c) = characters.next() {
        let starts_sub = c == '_' && characters.peek() == Some(&'{') && !sunk;
        if c != '*' && !starts_sub && !(c == '}' && sunk) {
            run.push(c);
            continue;
        }
        span(&mut out, &mut run, size, italic, sunk, &mut sinking);
        match c {
            '*' => italic = !italic,
            '_' => {
                characters.next();
                sunk = true;
            }
            _ => sunk = false,
        }
    }
    span(&mut out, &mut run, size, italic, sunk, &mut sinking);
    out
}

/// Writes one run of equal letters. `sinking` is how far below the line the last one stood: shifts in SVG add up.
fn span(
    out: &mut String,
    run: &mut String,
    size: f64,
    italic: bool,
    sunk: bool,
    sinking: &mut f64,
) {
    if run.is_empty() {
        return;
    }
    let depth = if sunk { SUB_DEPTH * size } else { 0.0 };
    out.push_str("<tspan");
    if depth != *sinking {
        write!(out, r#" dy="{:.2}""#, depth - *sinking).expect("a String takes everything");
    }
    if sunk {
        write!(out, r#" font-size="{:.2}""#, SUB_SIZE * size).expect("a String takes everything");
    }
    if italic {
        out.push_str(r#" font-style="italic""#);
    }
    out.push('>');
    out.push_str(&escape(run));
    out.push_str("</tspan>");
    run.clear();
    *sinking = depth;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subscript_does_not_leave_the_rest_of_the_line_sunk() {
        let text = spans("*a*_{c} = 1", 10.0);
        assert_eq!(
            text,
            r#"<tspan font-style="italic">a</tspan><tspan dy="2.20" font-size="7.20">c</tspan><tspan dy="-2.20"> = 1</tspan>"#
        );
    }

    #[test]
    fn a_name_cannot_end_the_markup() {
        assert_eq!(spans("a<b>\u{7}&", 10.0), "<tspan>a&lt;b&gt; &amp;</tspan>");
        assert_eq!(spans("a_b", 10.0), "<tspan>a_b</tspan>");
    }
}
