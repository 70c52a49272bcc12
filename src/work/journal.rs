//! Results of long loops in a file, for a program that goes on where it was killed.
//!
//! ```text
//! 8 bytes "radilog", version                                          MAGIC
//! record: what the work is of, names and hashes
//! record: loop, first item, results    )
//! record: …                            )  in the order in which they were made
//!
//! a record is  8 bytes length · content, postcard · 8 bytes XXH3-64 of both
//! ```
//!
//! Loops have the numbers in which they began; the program that resumes begins the same loops in
//! the same order, since it has the same input. Batches may end elsewhere. A record that was being
//! written when the program was killed is cut off.

use std::collections::HashMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use crate::error::{Error, ErrorKind, quoted};
use crate::progress::Instant;

/// Begins every file; the last byte is the version.
const MAGIC: &[u8; 8] = b"radilog\x01";

/// Bytes of the length of a record.
const LENGTH: usize = 8;

/// Records are written when as many bytes are there, or after as long: a kill costs no more.
const BUFFER: usize = 1 << 22;
const INTERVAL: Duration = Duration::from_secs(1);

/// Results of long loops in a file.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    /// Bytes that are not in the file yet.
    buffer: Vec<u8>,
    written: Instant,
    /// Where the results of a loop from an item on are: start and number of bytes.
    records: HashMap<(u64, u64), (u64, usize)>,
    failure: Option<Error>,
}

/// What the results of a journal depend on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct JournalPart {
    /// Such as "scene".
    pub name: String,
    /// Hash of it.
    pub hash: u64,
}

impl Journal {
    /// The journal at `path` of work that depends on `parts`: that which is there, or a new one.
    ///
    /// # Errors
    /// [`ErrorKind::File`] when the file cannot be read or written, is none of these, is of other
    /// parts, which it names, or is in use by another program.
    pub fn open(path: impl AsRef<Path>, parts: &[JournalPart]) -> Result<Journal, Error> {
        let path = path.as_ref();
        let failed = |error: io::Error| file_error(path, &error);
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(failed)?;
        // File systems without locks have none to refuse.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let remedy = "wait until that has ended, or give the name of another file";
            let found = "in use by another run";
            return Err(Error::new(ErrorKind::File, path.display().to_string(), found, remedy));
        }
        let mut records = HashMap::new();
        let mut reader = Reader { input: io::BufReader::new(&mut file), at: 0 };
        let mut magic = [0; MAGIC.len()];
        let whole = match reader.read(&mut magic).map_err(failed)? {
            false => 0,
            true if magic != *MAGIC => {
                let found = "not a state of a bake, or that of another version";
                return Err(refuse(path, found));
            }
            true => {
                let mut whole = 0;
                while let Some((start, content)) = reader.record().map_err(failed)? {
                    if whole == 0 {
                        check_parts(path, &content, parts)?;
                    } else if let Ok(((number, first), results)) =
                        postcard::take_from_bytes::<(u64, u64)>(&content)
                    {
                        let skipped = content.len() - results.len();
                        records.insert((number, first), (start + skipped as u64, results.len()));
                    }
                    whole = reader.at;
                }
                whole
            }
        };
        let mut journal = Journal {
            path: path.into(),
            file,
            buffer: vec![],
            written: Instant::now(),
            records,
            failure: None,
        };
        // What was torn off when the program was killed.
        journal.file.set_len(whole).map_err(failed)?;
        if whole == 0 {
            journal.buffer.extend(MAGIC);
            journal.buffer.extend(record(&parts));
            journal.flush();
        }
        match journal.failure.take() {
            Some(error) => Err(error),
            None => Ok(journal),
        }
    }

    /// Whether it has results that were not taken.
    pub(super) fn has_records(&self) -> bool {
        !self.records.is_empty()
    }

    /// The bytes of the results of loop `number` from item `first` on, once.
    pub(super) fn take(&mut self, number: u64, first: u64) -> Option<Vec<u8>> {
        let (start, len) = self.records.remove(&(number, first))?;
        let mut bytes = vec![0; len];
        let read = self.file.seek(SeekFrom::Start(start)).and_then(|_| {
            let (file, bytes) = (&mut self.file, &mut bytes);
            file.read_exact(bytes)
        });
        read.ok().map(|()| bytes)
    }

    /// Appends the results of loop `number` from item `first` on: by a record for each thread,
    /// since all wait.
    pub(super) fn append<R: Serialize + Sync>(&mut self, number: u64, first: u64, results: &[R]) {
        let len = results.len().div_ceil(rayon::current_num_threads()).max(1);
        let of_part = |(k, part): (usize, &[R])| record(&(number, first + (k * len) as u64, part));
        let records: Vec<Vec<u8>> = results.par_chunks(len).enumerate().map(of_part).collect();
        records.iter().for_each(|record| self.buffer.extend(record));
        if self.buffer.len() >= BUFFER || self.written.elapsed() >= INTERVAL {
            self.flush();
        }
    }

    fn append_buffer(&mut self) -> io::Result<()> {
        self.file.seek(SeekFrom::End(0))?;
        self.file.write_all(&self.buffer)
    }

    /// Writes what is not in the file yet. A failure is kept: work goes on without a journal.
    fn flush(&mut self) {
        if self.failure.is_none()
            && let Err(error) = self.append_buffer()
        {
            self.failure = Some(file_error(&self.path, &error));
        }
        self.buffer.clear();
        self.written = Instant::now();
    }

    /// Writes all that there is.
    ///
    /// # Errors
    /// [`ErrorKind::File`] if something could not be written, now or before.
    pub fn finish(mut self) -> Result<(), Error> {
        self.flush();
        self.failure.take().map_or(Ok(()), Err)
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        self.flush();
    }
}

/// Reads records one after the other.
struct Reader<R> {
    input: R,
    at: u64,
}

impl<R: Read> Reader<R> {
    /// Fills `bytes`, unless the input ends before.
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<bool> {
        match self.input.read_exact(bytes) {
            Ok(()) => {
                self.at += bytes.len() as u64;
                Ok(true)
            }
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Start and content of the next record, if it is whole.
    fn record(&mut self) -> io::Result<Option<(u64, Vec<u8>)>> {
        let mut length = [0; LENGTH];
        if !self.read(&mut length)? {
            return Ok(None);
        }
        let start = self.at;
        // A length that is damaged may be any.
        let mut bytes = length.to_vec();
        let wanted = u64::from_le_bytes(length);
        let read = self.input.by_ref().take(wanted).read_to_end(&mut bytes)? as u64;
        self.at += read;
        let mut sum = [0; 8];
        let is_whole =
            read == wanted && self.read(&mut sum)? && sum == xxh3_64(&bytes).to_le_bytes();
        Ok(is_whole.then(|| (start, bytes.split_off(LENGTH))))
    }
}

/// `content` as a record.
fn record(content: &(impl Serialize + ?Sized)) -> Vec<u8> {
    let bytes = postcard::to_extend(content, vec![0; LENGTH]);
    let mut bytes = bytes.expect("a vector takes all bytes");
    let length = (bytes.len() - LENGTH) as u64;
    bytes[..LENGTH].copy_from_slice(&length.to_le_bytes());
    bytes.extend(xxh3_64(&bytes).to_le_bytes());
    bytes
}

fn check_parts(path: &Path, content: &[u8], parts: &[JournalPart]) -> Result<(), Error> {
    let Ok(found) = postcard::from_bytes::<Vec<JournalPart>>(content) else {
        return Err(refuse(path, "damaged"));
    };
    let other: Vec<&str> =
        parts.iter().filter(|part| !found.contains(part)).map(|part| &part.name[..]).collect();
    if other.is_empty() && found.len() == parts.len() {
        return Ok(());
    }
    Err(refuse(path, &format!("the state of other work: other {}", quoted(&other))))
}

fn refuse(path: &Path, found: &str) -> Error {
    let remedy = "give the command that wrote it again, or the name of a new file";
    Error::new(ErrorKind::File, path.display().to_string(), found, remedy)
}

fn file_error(path: &Path, error: &io::Error) -> Error {
    let remedy = "name a file in a folder that can be written to and has room";
    Error::new(ErrorKind::File, path.display().to_string(), error.to_string(), remedy)
}
