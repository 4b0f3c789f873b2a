//! A number as a user would write it.

use std::fmt;

/// Written without a row of zeros: 1e308 is `1e308`, 1e-7 is `1e-7`, 0.02 is `0.02`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plain(pub f64);

impl fmt::Display for Plain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.abs();
        if size >= 1e16 || (size > 0.0 && size < 1e-5) {
            write!(f, "{:e}", self.0)
        } else {
            write!(f, "{}", self.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_number_is_longer_than_its_digits() {
        let written = [
            0.0,
            -0.02,
            1e-5,
            9e-6,
            1e-320,
            123_456.5,
            1e16,
            -1e308,
            f64::NAN,
        ];
        let written = written.map(|number| Plain(number).to_string());
        let expected = [
            "0", "-0.02", "0.00001", "9e-6", "1e-320", "123456.5", "1e16", "-1e308", "NaN",
        ];
        assert_eq!(written, expected);
    }
}
