//! Text of OBJ and MTL files: numbered lines, keywords, words, and errors that name the line.

use std::borrow::Cow;
use std::fmt::Display;
use std::path::Path;

use crate::error::{Error, ErrorKind, shortened};

/// A line of a file, for messages.
pub(super) struct Line<'a> {
    pub file: &'a Path,
    /// Counted from 1; where backslashes join several, the first of them.
    pub number: usize,
    /// Without surrounding white space.
    pub text: Cow<'a, str>,
}

impl Line<'_> {
    /// The first word, and what follows it.
    pub fn keyword(&self) -> (&str, &str) {
        let (keyword, rest) = self.text.split_once(char::is_whitespace).unwrap_or((&self.text, ""));
        (keyword, rest.trim_start())
    }

    /// `file:line`.
    pub fn place(&self) -> String {
        place(self.file, self.number)
    }

    /// The error `found` at this line, with its `remedy`.
    pub fn parse_error(&self, found: impl Display, remedy: impl Into<String>) -> Error {
        self.parse_error_as(ErrorKind::Scene, found, remedy)
    }

    /// The same, as an error of `kind`.
    pub fn parse_error_as(
        &self,
        kind: ErrorKind,
        found: impl Display,
        remedy: impl Into<String>,
    ) -> Error {
        let found = format!("{found} in {:?}", self.start());
        Error::new(kind, self.place(), found, remedy)
    }

    /// Its text, short enough for a message.
    pub fn start(&self) -> Cow<'_, str> {
        shortened(&self.text)
    }
}

/// `file:line`.
pub(super) fn place(file: &Path, line: usize) -> String {
    format!("{}:{line}", file.display())
}

/// The physical lines of `text`, ending with LF, CRLF or CR. A byte-order mark is skipped.
pub(super) fn physical_lines<'a>(file: &'a Path, text: &'a str) -> impl Iterator<Item = Line<'a>> {
    let end = if text.contains('\n') { '\n' } else { '\r' };
    let lines = text.strip_prefix('\u{feff}').unwrap_or(text).split(end);
    lines.zip(1..).map(move |(text, number)| Line { file, number, text: text.trim().into() })
}

/// The same, with lines joined to the next at a trailing backslash.
pub(super) fn lines<'a>(file: &'a Path, text: &'a str) -> impl Iterator<Item = Line<'a>> {
    let mut physical = physical_lines(file, text);
    std::iter::from_fn(move || {
        let Line { number, mut text, .. } = physical.next()?;
        while let Some(start) = text.strip_suffix('\\').map(str::len) {
            let joined = text.to_mut();
            joined.truncate(start);
            let Some(next) = physical.next() else { break };
            joined.push(' ');
            joined.push_str(&next.text);
        }
        Some(Line { file, number, text })
    })
}

/// Whether Blender's exporter wrote a file, by its first line: `# Blender 5.0.1` or alike.
pub(super) fn is_by_blender(text: &str) -> bool {
    text.strip_prefix('\u{feff}').unwrap_or(text).starts_with("# Blender ")
}

/// The words of `text` up to a comment.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split_whitespace().take_while(|word| !word.starts_with('#'))
}

/// `word` as a number, if it is one and finite.
pub(super) fn finite(word: &str) -> Option<f64> {
    word.parse().ok().filter(|x: &f64| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(text: &str) -> Vec<(usize, String)> {
        lines(Path::new("x"), text).map(|l| (l.number, l.text.into_owned())).collect()
    }
    fn owned(list: &[(usize, &str)]) -> Vec<(usize, String)> {
        list.iter().map(|&(n, s)| (n, s.to_string())).collect()
    }

    #[test]
    fn every_line_end_counts_once() {
        let three = owned(&[(1, "a"), (2, ""), (3, "b c"), (4, "")]);
        assert_eq!(split("a\n\nb c\n"), three);
        assert_eq!(split("a\r\n\r\n b c \r\n"), three);
        assert_eq!(split("\u{feff}a\r\rb c\r"), three);
    }

    #[test]
    fn backslash_joins_lines() {
        assert_eq!(split("f 1 \\\r\n 2\\\n3\nv"), owned(&[(1, "f 1  2 3"), (4, "v")]));
        assert_eq!(split("a\\"), owned(&[(1, "a")]));
    }
}
