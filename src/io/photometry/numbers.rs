//! The numbers of a photometric file, in order, independent of line breaks.

use std::path::Path;

use super::super::text::{Line, finite};
use crate::error::{Error, ErrorKind};

/// Meaning of a comma in a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Comma {
    Separates,
    IsDecimal,
}

/// The numbers of some lines, read on demand: memory follows the numbers present, not their
/// declared count.
pub struct Numbers<'a> {
    file: &'a Path,
    words: Box<dyn Iterator<Item = (usize, String)> + 'a>,
    /// The last line read.
    line: usize,
}

impl<'a> Numbers<'a> {
    pub fn new(file: &'a Path, lines: impl Iterator<Item = Line<'a>> + 'a, comma: Comma) -> Self {
        let words = lines.flat_map(move |line| {
            let text = match comma {
                Comma::Separates => line.text.replace([',', ';'], " "),
                Comma::IsDecimal => line.text.replace(',', "."),
            };
            let words: Vec<String> = text.split_whitespace().map(String::from).collect();
            words.into_iter().map(move |word| (line.number, word))
        });
        Numbers { file, words: Box::new(words), line: 0 }
    }

    /// The next number; `what` names it in errors.
    pub fn next(&mut self, what: &str) -> Result<f64, Error> {
        let Some((line, word)) = self.words.next() else {
            let found = format!("the file ends where {what} should stand");
            return Err(self.error(found, "give a file that is whole, with counts that are right"));
        };
        self.line = line;
        finite(&word).ok_or_else(|| {
            let found = format!("'{}' for {what}", crate::error::shortened(&word).escape_debug());
            self.error(found, "give a number")
        })
    }

    /// The next number as a count from 1.
    pub fn count(&mut self, what: &str) -> Result<usize, Error> {
        let number = self.next(what)?;
        if !(number >= 1.0 && number <= f64::from(u32::MAX) && number.fract() == 0.0) {
            return Err(self.error(format!("{what} {number}"), "give a whole number from 1"));
        }
        Ok(number as usize)
    }

    /// The next `count` numbers.
    pub fn list(&mut self, count: usize, what: &str) -> Result<Vec<f64>, Error> {
        (0..count).map(|_| self.next(what)).collect()
    }

    /// The numbers from here up to a word that is not a number.
    pub fn rest(&mut self) -> Vec<f64> {
        self.words.by_ref().map_while(|(_, word)| finite(&word)).collect()
    }

    /// Number of remaining words.
    pub fn left(self) -> usize {
        self.words.count()
    }

    /// The error `found`, at the last line read.
    pub fn error(&self, found: String, remedy: &str) -> Error {
        let place = super::super::text::place(self.file, self.line);
        Error::new(ErrorKind::Scene, place, found, remedy)
    }
}
