//! The crate's one error: place, finding and remedy.

use std::borrow::Cow;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

/// An error with its place, finding and remedy.
///
/// Shown with `{}`, it is one line: `place: found; remedy`.
/// From another process it has no source.
#[derive(Clone, Serialize, Deserialize)]
#[serde(from = "Inner", into = "Inner")]
pub struct Error(Arc<Inner>);

#[derive(Clone, Serialize, Deserialize)]
struct Inner {
    kind: ErrorKind,
    place: String,
    found: String,
    remedy: String,
    #[serde(skip)]
    source: Option<Arc<dyn std::error::Error + Send + Sync>>,
}

impl From<Inner> for Error {
    fn from(inner: Inner) -> Error {
        Error(Arc::new(inner))
    }
}

impl From<Error> for Inner {
    fn from(error: Error) -> Inner {
        Arc::unwrap_or_clone(error.0)
    }
}

/// The broad class of an [`Error`], for callers that react differently to each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A scene that cannot be used: geometry, materials or a malformed file.
    Scene,
    /// A setting outside its range.
    Setting,
    /// A file that could not be read or written.
    File,
    /// No usable graphics device, or a device that failed.
    Device,
    /// A graphics device without enough memory, however small the batches; it stays usable.
    Memory,
    /// A form-factor row that breaks its contract, reported by the solver.
    FormFactor,
}

impl Error {
    /// An error of `kind` at `place`: `found` is the finding, `remedy` the correction.
    pub fn new(
        kind: ErrorKind,
        place: impl Into<String>,
        found: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        let (place, found, remedy) = (place.into(), found.into(), remedy.into());
        Error(Arc::new(Inner { kind, place, found, remedy, source: None }))
    }

    /// The same error with the lower-level one that caused it.
    pub fn with_source(
        mut self,
        source: impl Into<Box<dyn std::error::Error + Send + Sync>>,
    ) -> Self {
        Arc::make_mut(&mut self.0).source = Some(Arc::from(source.into()));
        self
    }

    /// The same error with `file` before its place.
    pub(crate) fn inside(mut self, file: &Path) -> Self {
        let inner = Arc::make_mut(&mut self.0);
        inner.place = format!("{}: {}", file.display(), inner.place);
        self
    }

    /// The class of this error.
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// Whether a device is at fault: with another one the same may work.
    pub fn is_device_error(&self) -> bool {
        matches!(self.kind(), ErrorKind::Device | ErrorKind::Memory)
    }

    /// Place in the input: a file and line, a material, a setting.
    pub fn place(&self) -> &str {
        &self.0.place
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Inner { place, found, remedy, .. } = &*self.0;
        write!(f, "{place}: {found}; {remedy}")
    }
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?} error at {self}", self.0.kind)
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.0.source.as_ref().map(|e| &**e as &(dyn std::error::Error + 'static))
    }
}

/// The start of `text`, short enough for a message.
pub(crate) fn shortened(text: &str) -> Cow<'_, str> {
    const LONGEST: usize = 60;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => Cow::Owned(format!("{}…", &text[..end])),
        None => Cow::Borrowed(text),
    }
}

/// Up to eight of `names`, quoted, and the number of the others.
pub(crate) fn quoted<S: AsRef<str>>(names: &[S]) -> String {
    quoted_few(names, 8)
}

/// Up to `shown` of `names`, quoted, and the number of the others.
pub(crate) fn quoted_few<S: AsRef<str>>(names: &[S], shown: usize) -> String {
    let name = |name: &S| format!("'{}'", shortened(name.as_ref()).escape_debug());
    let mut list = names.iter().take(shown).map(name).collect::<Vec<_>>().join(", ");
    if names.len() > shown {
        list += &format!(" and {} more", names.len() - shown);
    }
    list
}

/// The likely intended one of `names` for `wrong`: equal but for case, or a few typing errors off.
pub(crate) fn nearest<'n>(
    wrong: &str,
    names: impl IntoIterator<Item = &'n str>,
) -> Option<&'n str> {
    /// Least number of letters per typing error; longest name that is compared.
    const LETTERS_AN_ERROR: usize = 3;
    const LONGEST: usize = 100;
    let lower = |name: &str| name.to_lowercase();
    let wrong = lower(wrong);
    let count = wrong.chars().count();
    let near = names.into_iter().filter(|name| name.len() <= LONGEST && count <= LONGEST);
    let distances = near.map(|name| (strsim::osa_distance(&wrong, &lower(name)), name));
    let nearest = distances.min_by_key(|(distance, _)| *distance);
    nearest.filter(|(distance, _)| *distance <= count / LETTERS_AN_ERROR).map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_stay_short() {
        assert_eq!(shortened(&"é".repeat(1000)).chars().count(), 61);
        assert_eq!(quoted(&["a"; 10]), format!("{} and 2 more", ["'a'"; 8].join(", ")));
    }

    #[test]
    fn names_are_meant_that_are_a_few_letters_off() {
        let names = ["light", "lamp_shade", "wall"];
        for (wrong, meant) in [
            ("Light", Some("light")),
            ("lihgt", Some("light")),
            ("lampshade", Some("lamp_shade")),
            ("well", Some("wall")),
            ("floor", None),
            ("", None),
        ] {
            assert_eq!(nearest(wrong, names), meant, "{wrong}");
        }
        let long = "x".repeat(1000);
        assert_eq!(nearest(&long, [&*long]), None);
    }
}
