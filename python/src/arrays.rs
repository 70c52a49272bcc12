//! Arrays that are views of what the library made, and the other way round.

use numpy::ndarray::{ArrayView1, ArrayView2, ArrayView3, Dimension};
use numpy::{Element, PyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods as _};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods as _};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use radiosity::Rgb;
use radiosity::glam::DVec3;

/// A read-only array over `values`, (n,).
///
/// `owner` must keep `values` alive and never change them: a frozen class that holds them.
pub fn view1<'py, T: Element>(owner: &Bound<'py, PyAny>, values: &[T]) -> Bound<'py, PyArray1<T>> {
    // SAFETY: `values` belong to `owner`, which the array keeps, and nothing writes to them.
    read_only(unsafe { PyArray1::borrow_from_array(&ArrayView1::from(values), owner.clone()) })
}

/// A read-only array over `values`, (n, N): see [`view1`].
pub fn view2<'py, T: Element, const N: usize>(
    owner: &Bound<'py, PyAny>,
    values: &[[T; N]],
) -> Bound<'py, PyArray2<T>> {
    // SAFETY: as in `view1`.
    read_only(unsafe { PyArray2::borrow_from_array(&ArrayView2::from(values), owner.clone()) })
}

/// A read-only array over `values`, (rows, columns, 3): see [`view1`].
pub fn image<'py>(
    owner: &Bound<'py, PyAny>,
    values: &[Rgb],
    [columns, rows]: [u32; 2],
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let flat: &[f64] = bytemuck::cast_slice(values);
    let shape = (rows as usize, columns as usize, 3);
    let view = ArrayView3::from_shape(shape, flat);
    let view = view.map_err(|e| PyValueError::new_err(e.to_string()))?;
    // SAFETY: as in `view1`.
    Ok(read_only(unsafe { PyArray3::borrow_from_array(&view, owner.clone()) }))
}

fn read_only<T: Element, D: Dimension>(
    array: Bound<'_, PyArray<T, D>>,
) -> Bound<'_, PyArray<T, D>> {
    array.readwrite().make_nonwriteable();
    array
}

/// Vectors as rows.
pub fn rows(vectors: &[DVec3]) -> &[[f64; 3]] {
    bytemuck::cast_slice(vectors)
}

/// Rows as vectors.
pub fn vectors(array: &PyReadonlyArray2<'_, f64>) -> Vec<DVec3> {
    array.as_array().rows().into_iter().map(|row| DVec3::new(row[0], row[1], row[2])).collect()
}

/// The numbers of an array in any layout.
pub fn numbers<T: Element + Copy>(array: &PyReadonlyArray1<'_, T>) -> Vec<T> {
    array.as_array().iter().copied().collect()
}

/// Refuses an array of another shape: the caller has checked it, so this is a mistake there.
pub fn check_columns(array: &PyReadonlyArray2<'_, impl Element>, columns: usize) -> PyResult<()> {
    if array.shape()[1] == columns {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{:?}: give (n, {columns})", array.shape())))
}
