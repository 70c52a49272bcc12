//! Matrices of view factors in `.npz` files: the compressed sparse rows of SciPy.
//!
//! | array | numbers | content |
//! |---|---|---|
//! | `format`, `shape`, `indptr`, `indices`, `data` | | input of `scipy.sparse.load_npz` |
//! | `standard_error` | as `data` | of each factor |
//! | `area`, `open`, `open_error`, `back`, `back_error` | one per group | |
//! | `names` | bytes | of all groups, UTF-8, a line feed between |
//! | `back_of` | one per group | the group whose back it is, from 0; −1 for fronts |
//! | `absent` | 1 | meaning of a missing pair: 0 for zero, 2 for unmet ([`Missing`]) |

use std::io::{Read, Seek, Write};

use npyz::WriterBuilder;
use zip::write::{SimpleFileOptions, StreamWriter};
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::{Input, Output};
use crate::error::{Error, ErrorKind};
use crate::view_factor::{Estimate, Factor, MatrixRows, Missing, ViewFactors, are_sides};

/// Writes the nonzeros as the compressed sparse rows that `scipy.sparse.load_npz` reads, and
/// additional arrays, which it ignores: `standard_error` of each; of each group `area`, `open` and
/// `back` with their errors; `names`, separated by line feeds; `back_of`; `absent`.
///
/// # Errors
/// [`ErrorKind::File`] when the file cannot be written.
pub fn write_npz<'o>(out: impl Into<Output<'o>>, matrix: &ViewFactors) -> Result<(), Error> {
    let n = matrix.names.len() as i64;
    let factors = || matrix.factors.iter().flatten();
    let ends = matrix.factors.iter().scan(0, |end, row| {
        *end += row.len() as i64;
        Some(*end)
    });
    let row_starts: Vec<i64> = std::iter::once(0).chain(ends).collect();
    let count = row_starts[matrix.factors.len()] as u64;
    let names: Vec<String> = matrix.names.iter().map(|n| n.replace('\n', " ")).collect();
    let names = names.join("\n");
    let absent = match matrix.absent {
        Missing::Zero => 0u8,
        Missing::Unmet => 2,
    };
    out.into().write(|out| {
        let mut archive = Archive(ZipWriter::new_stream(out));
        archive.add_format("csr")?;
        archive.add("shape", 2, [n, n].into_iter())?;
        archive.add("indptr", row_starts.len() as u64, row_starts.iter().copied())?;
        archive.add("indices", count, factors().map(|f| f.to as i32))?;
        archive.add("data", count, factors().map(|f| f.value))?;
        archive.add("standard_error", count, factors().map(|f| f.error))?;
        archive.add("area", n as u64, matrix.areas.iter().copied())?;
        for (name, shares) in [("open", &matrix.open), ("back", &matrix.back)] {
            let errors = shares.iter().map(|share| share.error);
            archive.add(name, n as u64, shares.iter().map(|share| share.value))?;
            archive.add(&format!("{name}_error"), n as u64, errors)?;
        }
        archive.add("names", names.len() as u64, names.bytes())?;
        let back_of = matrix.back_of.iter().map(|front| front.map_or(-1, |front| front as i32));
        archive.add("back_of", n as u64, back_of)?;
        archive.add("absent", 1, std::iter::once(absent))?;
        archive.0.finish()?;
        Ok(())
    })
}

/// An `.npz` file: a zip archive of `.npy` files, none of them compressed.
struct Archive<'a>(ZipWriter<StreamWriter<&'a mut dyn Write>>);

impl Archive<'_> {
    /// Begins the array `name`.
    fn start(&mut self, name: &str) -> std::io::Result<()> {
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        // Arrays may exceed 4 GiB.
        Ok(self.0.start_file(format!("{name}.npy"), options.large_file(true))?)
    }

    /// Adds a one-dimensional array of `count` numbers.
    fn add<T: npyz::AutoSerialize>(
        &mut self,
        name: &str,
        count: u64,
        numbers: impl Iterator<Item = T>,
    ) -> std::io::Result<()> {
        self.start(name)?;
        let options = npyz::WriteOptions::new().default_dtype().shape(&[count]);
        let mut writer = options.writer(&mut self.0).begin_nd()?;
        writer.extend(numbers)?;
        writer.finish()
    }

    /// Adds the name of the sparse format: a string as an array of no dimensions.
    fn add_format(&mut self, format: &str) -> std::io::Result<()> {
        self.start("format")?;
        let text = format!("|S{}", format.len()).parse().map_err(std::io::Error::other)?;
        let options = npyz::WriteOptions::new().dtype(npyz::DType::Plain(text)).shape(&[]);
        let mut writer = options.writer(&mut self.0).begin_nd()?;
        writer.push(format.as_bytes())?;
        writer.finish()
    }
}

/// Reads a matrix written by [`write_npz`], or by a program with the same arrays; without `names`,
/// groups are named by their numbers, from 1; without `back_of`, all are fronts.
///
/// # Errors
/// [`ErrorKind::File`] when the file cannot be read, or an array is missing, compressed, of a wrong
/// type or length, or has numbers that are not valid in a matrix of view factors.
pub fn read_npz<'i>(file: impl Into<Input<'i>>) -> Result<ViewFactors, Error> {
    let file = file.into();
    read(file.open("give a readable .npz file")?).map_err(|e| e.inside(file.path()))
}

fn wrong(array: &str, found: impl Into<String>, remedy: impl Into<String>) -> Error {
    Error::new(ErrorKind::File, array, found, remedy)
}

fn read(bytes: impl Read + Seek) -> Result<ViewFactors, Error> {
    let mut archive = ZipArchive::new(bytes).map_err(|e| {
        wrong("archive", e.to_string(), "give an .npz file of view factors").with_source(e)
    })?;
    let mut arrays = Arrays { archive: &mut archive };
    let row_starts = arrays.integers("indptr", None)?;
    let groups = row_starts.len().saturating_sub(1);
    if groups == 0 || row_starts[0] != 0 || !row_starts.is_sorted() {
        let remedy = "where each row begins: 0 first, then ascending, one more than groups";
        return Err(wrong("indptr", "no sequence of rows", remedy));
    }
    let count = row_starts[groups] as usize;
    let columns = arrays.integers("indices", Some(count))?;
    let values: Vec<f64> = arrays.numbers("data", Some(count))?;
    let errors = arrays.sizes("standard_error", count)?;
    let areas = arrays.sizes("area", groups)?;
    let (open, back) = (arrays.shares("open", groups)?, arrays.shares("back", groups)?);
    let (MatrixRows { names, back_of }, absent) = (arrays.rows(groups)?, arrays.absent()?);
    check_range("data", &values, is_size, "at least 0")?;
    let mut factors = Vec::with_capacity(groups);
    for row in row_starts.windows(2) {
        let row = row[0] as usize..row[1] as usize;
        let to = &columns[row.clone()];
        let is_group = |to: &i64| (0..groups as i64).contains(to);
        if !to.iter().all(is_group) || !to.is_sorted_by(|a, b| a < b) {
            let found = format!("columns out of order or range of row {}", factors.len());
            return Err(wrong("indices", found, format!("ascending, from 0, below {groups}")));
        }
        let numbers = values[row.clone()].iter().zip(&errors[row]);
        let row = to.iter().zip(numbers);
        factors.push(
            row.map(|(&to, (&value, &error))| Factor { to: to as u32, value, error }).collect(),
        );
    }
    Ok(ViewFactors { names, back_of, areas, factors, open, back, absent })
}

fn is_size(value: f64) -> bool {
    value.is_finite() && value >= 0.0
}

fn check_range(
    name: &str,
    numbers: &[f64],
    is_right: impl Fn(f64) -> bool,
    remedy: &str,
) -> Result<(), Error> {
    match numbers.iter().find(|number| !is_right(**number)) {
        Some(number) => Err(wrong(name, number.to_string(), format!("it must be {remedy}"))),
        None => Ok(()),
    }
}

/// The arrays of an `.npz` file, by name.
struct Arrays<'a, R> {
    archive: &'a mut ZipArchive<R>,
}

impl<R: Read + Seek> Arrays<'_, R> {
    fn has(&self, name: &str) -> bool {
        self.archive.index_for_name(&format!("{name}.npy")).is_some()
    }

    /// The names of `groups`; without the array, their numbers from 1.
    fn names(&mut self, groups: usize) -> Result<Vec<String>, Error> {
        if !self.has("names") {
            return Ok((1..=groups).map(|k| k.to_string()).collect());
        }
        let bytes: Vec<u8> = self.numbers("names", None)?;
        let text = String::from_utf8_lossy(&bytes);
        let names: Vec<String> = text.split('\n').map(String::from).collect();
        if names.len() != groups {
            let remedy = format!("one a group, {groups}, with a line feed between");
            return Err(wrong("names", format!("{} lines", names.len()), remedy));
        }
        Ok(names)
    }

    /// Names and sides of `groups`.
    fn rows(&mut self, groups: usize) -> Result<MatrixRows, Error> {
        let numbers = match self.has("back_of") {
            true => self.integers("back_of", Some(groups))?,
            false => vec![-1; groups],
        };
        let front = |&front: &i64| (front != -1).then_some(front as u32);
        let back_of = numbers.iter().map(front).collect();
        let rows = MatrixRows { names: self.names(groups)?, back_of };
        let in_range = numbers.iter().all(|front| (-1..groups as i64).contains(front));
        if !in_range || !are_sides(&rows.back_of) {
            let remedy = "-1, or another group, which is a front and has no other back";
            return Err(wrong("back_of", "numbers of no fronts", remedy));
        }
        Ok(rows)
    }

    fn absent(&mut self) -> Result<Missing, Error> {
        let absent: Vec<u8> = match self.has("absent") {
            false => vec![0],
            true => self.numbers("absent", Some(1))?,
        };
        match absent[0] {
            0 => Ok(Missing::Zero),
            2 => Ok(Missing::Unmet),
            other => Err(wrong("absent", other.to_string(), "it is 0 or 2")),
        }
    }

    /// The array `name` of shares, and that of their errors.
    fn shares(&mut self, name: &str, count: usize) -> Result<Vec<Estimate>, Error> {
        let values: Vec<f64> = self.numbers(name, Some(count))?;
        check_range(name, &values, f64::is_finite, "finite")?;
        let pairs = values.into_iter().zip(self.sizes(&format!("{name}_error"), count)?);
        Ok(pairs.map(|(value, error)| Estimate { value, error }).collect())
    }

    /// The array `name` of numbers that are finite and not negative.
    fn sizes(&mut self, name: &str, count: usize) -> Result<Vec<f64>, Error> {
        let sizes: Vec<f64> = self.numbers(name, Some(count))?;
        check_range(name, &sizes, is_size, "finite and at least 0")?;
        Ok(sizes)
    }

    /// Integers of 32 or 64 bits, as SciPy chooses.
    fn integers(&mut self, name: &str, count: Option<usize>) -> Result<Vec<i64>, Error> {
        if let Ok(short) = self.numbers::<i32>(name, count) {
            return Ok(short.into_iter().map(i64::from).collect());
        }
        self.numbers(name, count)
    }

    /// The array `name`, of one dimension and, if given, `count` numbers.
    fn numbers<T: npyz::Deserialize>(
        &mut self,
        name: &str,
        count: Option<usize>,
    ) -> Result<Vec<T>, Error> {
        let missing = "the arrays of a matrix of view factors, not compressed";
        let file = self.archive.by_name(&format!("{name}.npy"));
        let mut file = file.map_err(|e| wrong(name, e.to_string(), missing).with_source(e))?;
        let broken = |e: std::io::Error| {
            wrong(name, e.to_string(), "give a whole array of numbers").with_source(e)
        };
        let mut start = [0; 10];
        file.read_exact(&mut start).map_err(broken)?;
        let length = usize::from(u16::from_le_bytes([start[8], start[9]]));
        // Version 1 has two bytes for the length; later versions are for long headers.
        // A plain array has 128 bytes.
        if !start.starts_with(b"\x93NUMPY\x01") || length > 512 {
            return Err(wrong(name, "no plain array", "NumPy's format, version 1.0"));
        }
        let mut header = start.to_vec();
        header.resize(start.len() + length, 0);
        file.read_exact(&mut header[start.len()..]).map_err(broken)?;
        if !is_plain(&header[start.len()..]) {
            return Err(wrong(name, "a header of many dimensions", "one dimension"));
        }
        let array = npyz::NpyFile::new(header.as_slice().chain(file)).map_err(broken)?;
        let length = match *array.shape() {
            [length] => length,
            ref shape => return Err(wrong(name, format!("shape {shape:?}"), "one dimension")),
        };
        if let Some(count) = count.filter(|&count| length != count as u64) {
            return Err(wrong(name, format!("{length} numbers"), format!("{count} of them")));
        }
        let data = array.data::<T>().map_err(|e| {
            wrong(name, e.to_string(), "the type that `write_npz` writes").with_source(e)
        })?;
        // The length is not trusted: memory grows with the data read.
        let mut numbers = vec![];
        for number in data {
            numbers.push(number.map_err(broken)?);
        }
        Ok(numbers)
    }
}

/// Whether the header of an array is that of one dimension, without overlong numbers.
fn is_plain(header: &[u8]) -> bool {
    let nested = header.iter().filter(|byte| b"([{".contains(byte)).count();
    let mut runs = header.split(|byte| !byte.is_ascii_digit());
    nested <= 2 && runs.all(|digits| digits.len() <= 12)
}
