//! A position in the bytes of a mesh file, and what can be read there.

use std::str::FromStr;

use super::error::GmshError;

/// How numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// As text.
    Ascii,
    /// As bytes, the lowest first.
    Little,
    /// As bytes, the highest first.
    Big,
}

/// Reads forward through the bytes.
#[derive(Debug)]
pub struct Scanner<'b> {
    bytes: &'b [u8],
    at: usize,
    section: String,
    /// How the numbers of the present section are written.
    pub encoding: Encoding,
}

impl<'b> Scanner<'b> {
    /// At the beginning of `bytes`.
    pub fn new(bytes: &'b [u8]) -> Self {
        Self {
            bytes,
            at: 0,
            section: String::new(),
            encoding: Encoding::Ascii,
        }
    }

    /// An error at this place.
    pub fn wrong(&self, what: impl Into<String>) -> GmshError {
        let section = match self.section.is_empty() {
            true => String::new(),
            false => format!("section `${}`, ", self.section),
        };
        let place = match self.encoding {
            Encoding::Ascii => {
                let lines = self.bytes[..self.at].iter().filter(|&&b| b == b'\n');
                format!("{section}line {}", lines.count() + 1)
            }
            _ => format!("{section}byte {}", self.at),
        };
        GmshError::Syntax {
            place,
            what: what.into(),
        }
    }

    /// How many items of at least `least` bytes the rest can hold: the most that a count is believed.
    pub fn room(&self, count: usize, least: usize) -> usize {
        count.min((self.bytes.len() - self.at) / least)
    }

    /// Enters the next section; `None` at the end of the file.
    pub fn next_section(&mut self) -> Result<Option<String>, GmshError> {
        self.section.clear();
        loop {
            self.skip_blanks();
            if self.at == self.bytes.len() {
                return Ok(None);
            }
            let line = self.line();
            // Text between sections is a comment.
            if let Some(name) = line.strip_prefix('$') {
                self.section = name.trim().chars().take(40).collect();
                return Ok(Some(self.section.clone()));
            }
        }
    }

    /// Expects the end of section `name`.
    pub fn close(&mut self, name: &str) -> Result<(), GmshError> {
        self.skip_blanks();
        let line = self.line();
        match line.trim() == format!("$End{name}") {
            true => Ok(()),
            false => Err(self.wrong(format!("`$End{name}` is expected here"))),
        }
    }

    /// Goes behind the end of the present section, whatever is in it.
    pub fn skip_section(&mut self) -> Result<(), GmshError> {
        let end = format!("$End{}", self.section);
        let rest = &self.bytes[self.at..];
        match rest.windows(end.len()).position(|w| w == end.as_bytes()) {
            Some(found) => {
                self.at += found + end.len();
                Ok(())
            }
            None => Err(self.wrong(format!("it does not end: there is no `{end}`"))),
        }
    }

    /// The rest of the line, without what ends it; bytes that are no text are replaced.
    fn line(&mut self) -> String {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        let line = String::from_utf8_lossy(&rest[..end]).trim_end().to_owned();
        self.at = (self.at + end + 1).min(self.bytes.len());
        line
    }

    /// Goes behind the end of the line.
    pub fn end_line(&mut self) {
        self.line();
    }

    fn skip_blanks(&mut self) {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    /// The next word of the text.
    pub fn word(&mut self) -> Result<&'b str, GmshError> {
        self.skip_blanks();
        let rest = &self.bytes[self.at..];
        let end = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        if end == 0 {
            return Err(self.wrong("the file ends in the middle of a section"));
        }
        let word = std::str::from_utf8(&rest[..end])
            .map_err(|_| self.wrong("there are bytes here that are no text"))?;
        self.at += end;
        Ok(word)
    }

    /// The next word as a number.
    pub fn word_number<T: FromStr>(&mut self) -> Result<T, GmshError> {
        let word = self.word()?;
        word.parse().map_err(|_| {
            let shown: String = word.chars().take(40).collect();
            self.wrong(format!("`{shown}` is not the number that is expected here"))
        })
    }

    /// The next word as a count.
    pub fn word_count(&mut self) -> Result<usize, GmshError> {
        self.word_number()
    }

    /// The name between quotation marks on the rest of the line.
    pub fn quoted(&mut self) -> Result<String, GmshError> {
        let line = self.line();
        let name = line
            .split_once('"')
            .and_then(|(_, rest)| rest.rsplit_once('"'))
            .map(|(name, _)| name.to_owned());
        name.ok_or_else(|| self.wrong("a name between quotation marks is expected here"))
    }

    /// The 1 behind the header of a binary file, which tells the order of bytes.
    pub fn byte_order(&mut self) -> Result<Encoding, GmshError> {
        let order = match self.take::<4>()? {
            [1, 0, 0, 0] => Encoding::Little,
            [0, 0, 0, 1] => Encoding::Big,
            _ => {
                return Err(
                    self.wrong("the number 1, which tells the order of bytes, is expected here")
                );
            }
        };
        Ok(order)
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], GmshError> {
        let bytes = self.bytes[self.at..].first_chunk::<N>();
        let bytes = bytes.ok_or_else(|| self.wrong("the file ends in the middle of a section"))?;
        self.at += N;
        Ok(*bytes)
    }

    /// A number of four bytes, or a word.
    pub fn int(&mut self) -> Result<i64, GmshError> {
        Ok(match self.encoding {
            Encoding::Ascii => self.word_number()?,
            Encoding::Little => i64::from(i32::from_le_bytes(self.take()?)),
            Encoding::Big => i64::from(i32::from_be_bytes(self.take()?)),
        })
    }

    /// A number of four bytes that is not negative, or a word.
    pub fn unsigned(&mut self) -> Result<u32, GmshError> {
        let number = self.int()?;
        u32::try_from(number).map_err(|_| self.wrong(format!("{number} cannot stand here")))
    }

    /// A number of eight bytes, or a word.
    pub fn long(&mut self) -> Result<u64, GmshError> {
        Ok(match self.encoding {
            Encoding::Ascii => self.word_number()?,
            Encoding::Little => u64::from_le_bytes(self.take()?),
            Encoding::Big => u64::from_be_bytes(self.take()?),
        })
    }

    /// A count of eight bytes, or a word.
    pub fn count(&mut self) -> Result<usize, GmshError> {
        let number = self.long()?;
        usize::try_from(number).map_err(|_| self.wrong(format!("{number} is no count")))
    }

    /// A coordinate.
    pub fn double(&mut self) -> Result<f64, GmshError> {
        let number: f64 = match self.encoding {
            Encoding::Ascii => self.word_number()?,
            Encoding::Little => f64::from_le_bytes(self.take()?),
            Encoding::Big => f64::from_be_bytes(self.take()?),
        };
        match number.is_finite() {
            true => Ok(number),
            false => Err(self.wrong(format!("{number} is no coordinate"))),
        }
    }

    /// A position.
    pub fn position(&mut self) -> Result<[f64; 3], GmshError> {
        Ok([self.double()?, self.double()?, self.double()?])
    }
}
