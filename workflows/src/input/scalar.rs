//! What an unquoted word of YAML means, by the core schema of YAML 1.2: `no` and `on` are texts, `1e3` is a number.

/// The meaning of one unquoted word.
#[derive(Debug, Clone, PartialEq)]
pub enum Scalar {
    /// Nothing, `~` or `null`.
    Null,
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// Any other finite number.
    Float(f64),
    /// A number that is none, or too large for one: `.nan`, `.inf`, `1e999`.
    NotFinite,
    /// Everything else.
    Text,
}

/// Reads one unquoted word.
pub fn read(word: &str) -> Scalar {
    match word {
        "" | "~" | "null" | "Null" | "NULL" => return Scalar::Null,
        "true" | "True" | "TRUE" => return Scalar::Bool(true),
        "false" | "False" | "FALSE" => return Scalar::Bool(false),
        _ => {}
    }
    let unsigned = word.strip_prefix(['+', '-']).unwrap_or(word);
    if [".inf", ".Inf", ".INF"].contains(&unsigned) || [".nan", ".NaN", ".NAN"].contains(&word) {
        return Scalar::NotFinite;
    }
    if !is_decimal(unsigned) {
        return Scalar::Text;
    }
    if let Ok(integer) = word.parse() {
        return Scalar::Integer(integer);
    }
    match word.parse::<f64>() {
        Ok(float) if float.is_finite() => Scalar::Float(float),
        Ok(_) => Scalar::NotFinite,
        Err(_) => Scalar::Text,
    }
}

/// `12`, `12.`, `.5`, `1.5e-3`; not `inf`, `1_000` or `0x1f`, which `f64::from_str` or older YAML would take.
fn is_decimal(word: &str) -> bool {
    let (mantissa, exponent) = match word.find(['e', 'E']) {
        Some(at) => (&word[..at], Some(&word[at + 1..])),
        None => (word, None),
    };
    let digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let exponent_is_good = exponent.is_none_or(|exponent| {
        let exponent = exponent.strip_prefix(['+', '-']).unwrap_or(exponent);
        !exponent.is_empty() && digits(exponent)
    });
    digits(whole)
        && digits(fraction)
        && !(whole.is_empty() && fraction.is_empty())
        && exponent_is_good
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_yaml_are_not_taken_for_numbers() {
        for word in [
            "no", "inf", "nan", "1_000", "0x1f", "1/64", "e3", ".", "-", "1e", "1.2.3", "--1",
        ] {
            assert_eq!(read(word), Scalar::Text, "{word}");
        }
    }

    #[test]
    fn numbers_keep_their_value() {
        assert_eq!(read("-12"), Scalar::Integer(-12));
        assert_eq!(read("1e-3"), Scalar::Float(1e-3));
        assert_eq!(read("+.5"), Scalar::Float(0.5));
        assert_eq!(read("99999999999999999999"), Scalar::Float(1e20));
        assert_eq!(read("1e999"), Scalar::NotFinite);
        assert_eq!(read("-.inf"), Scalar::NotFinite);
    }
}
