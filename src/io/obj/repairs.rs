//! Repairs and skipped statements so far: one warning per kind, or, when strict, an error.

use super::super::text::Line;
use crate::error::{Error, ErrorKind, quoted};
use crate::scene::{Warning, WarningKind};

pub(in crate::io) struct Repairs {
    strict: bool,
    warnings: Vec<Warning>,
}

impl Repairs {
    pub fn new(strict: bool) -> Repairs {
        Repairs { strict, warnings: vec![] }
    }

    /// Counts a finding in `line`, about `name` if that is not empty.
    pub fn note(
        &mut self,
        kind: WarningKind,
        line: &Line,
        name: &str,
        done: impl Into<String>,
    ) -> Result<(), Error> {
        self.refuse(kind, name, || (line.place(), format!(" in {:?}", line.start())))?;
        self.count(kind, name, done, || Some(line.place()));
        Ok(())
    }

    /// The same for a finding at `place`, a file and line.
    pub fn note_at(
        &mut self,
        kind: WarningKind,
        place: impl Fn() -> String,
        name: &str,
        done: impl Into<String>,
    ) -> Result<(), Error> {
        self.refuse(kind, name, || (place(), String::new()))?;
        self.count(kind, name, done, || Some(place()));
        Ok(())
    }

    fn refuse(
        &self,
        kind: WarningKind,
        name: &str,
        place_and_text: impl FnOnce() -> (String, String),
    ) -> Result<(), Error> {
        let Some(remedy) = kind.remedy().filter(|_| self.strict) else { return Ok(()) };
        let (place, text) = place_and_text();
        let name = if name.is_empty() { name.into() } else { format!(" {}", quoted(&[name])) };
        let found = format!("{}{name}{text}", kind.nouns().0);
        Err(Error::new(ErrorKind::Scene, place, found, remedy))
    }

    fn count(
        &mut self,
        kind: WarningKind,
        name: &str,
        done: impl Into<String>,
        place: impl FnOnce() -> Option<String>,
    ) {
        let at = self.warnings.iter().position(|w| w.kind == kind).unwrap_or_else(|| {
            self.warnings.push(Warning { place: place(), ..Warning::new(kind, 0, done) });
            self.warnings.len() - 1
        });
        self.warnings[at].count += 1;
        if !name.is_empty() {
            self.warnings[at].add_name(crate::error::shortened(name));
        }
    }

    /// Adds a complete warning.
    pub fn push(&mut self, warning: Warning) {
        self.warnings.push(warning);
    }

    /// Number of findings of `kind` so far.
    pub fn count_of(&self, kind: WarningKind) -> usize {
        self.warnings.iter().filter(|w| w.kind == kind).map(|w| w.count).sum()
    }

    pub fn into_warnings(self) -> Vec<Warning> {
        self.warnings
    }
}
