//! The points of grids as CSV.

use radiosity::grid::{MeasuredGrid, Quantity};

/// A line a point, with a header.
pub fn csv(grids: &[MeasuredGrid], quantity: Quantity) -> csv::Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(vec![]);
    let name = match quantity {
        Quantity::Irradiance => "irradiance",
        Quantity::Illuminance => "illuminance",
    };
    let channels = ["irradiance_r", "irradiance_g", "irradiance_b"];
    let head = ["grid", "column", "row", "x", "y", "z", name, "standard_error"];
    table.write_record(head.into_iter().chain(channels).chain(["inside"]))?;
    for (k, measured) in grids.iter().enumerate() {
        let grid = &measured.grid;
        for (n, (point, value)) in grid.points.iter().zip(&measured.values).enumerate() {
            let (Some(point), Some(value)) = (point, value) else { continue };
            let [one, error] = [value.irradiance, value.standard_error].map(|c| quantity.of(c));
            let place = [n % grid.counts[0], n / grid.counts[0]].map(|n| n.to_string());
            let numbers = [point.to_array().to_vec(), vec![one, error]].concat();
            let numbers = numbers.into_iter().chain(value.irradiance.to_array());
            let mut line = vec![format!("{} {}", k + 1, grid.name)];
            line.extend(place);
            line.extend(numbers.map(|x| x.to_string()));
            line.push(u8::from(value.is_buried()).to_string());
            table.write_record(line)?;
        }
    }
    table.into_inner().map_err(|e| e.into_error().into())
}
