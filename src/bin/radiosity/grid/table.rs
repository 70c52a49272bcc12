//! The points of grids as CSV.

use radiosity::grid::{MeasuredGrid, Quantity};

use crate::args;

/// A line a point, with a header.
pub fn csv(grids: &[MeasuredGrid], quantity: Quantity) -> Vec<u8> {
    let name = match quantity {
        Quantity::Irradiance => "irradiance",
        Quantity::Illuminance => "illuminance",
    };
    let channels = "irradiance_r,irradiance_g,irradiance_b";
    let head = format!("grid,column,row,x,y,z,{name},standard_error,{channels},inside");
    let mut rows = vec![];
    for (k, measured) in grids.iter().enumerate() {
        let grid = &measured.grid;
        for (n, (point, value)) in grid.points.iter().zip(&measured.values).enumerate() {
            let (Some(point), Some(value)) = (point, value) else { continue };
            let [one, error] = [value.irradiance, value.standard_error].map(|c| quantity.of(c));
            let mut row = vec![format!("{} {}", k + 1, grid.name)];
            row.extend([n % grid.counts[0], n / grid.counts[0]].map(|n| n.to_string()));
            row.extend(point.to_array().map(|x| x.to_string()));
            row.extend([one, error].map(|x| x.to_string()));
            row.extend(value.irradiance.to_array().map(|x| x.to_string()));
            row.push(u8::from(value.is_buried()).to_string());
            rows.push(row);
        }
    }
    args::csv(&head, rows)
}
