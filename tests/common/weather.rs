//! Weather files that are made up.

/// Days of the months.
pub const DAYS: [u32; 12] = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];

/// A year at degrees north and east and hours from UTC, with direct normal and diffuse horizontal
/// irradiance by month and by the hour from 1 to 24.
pub fn epw_at(
    [latitude, longitude, zone]: [f64; 3],
    irradiance: impl Fn(u32, u32) -> [f64; 2],
) -> String {
    let mut text = format!(
        "LOCATION,Nowhere,-,-,made up,0,{latitude},{longitude},{zone},100\n\
         COMMENTS 1,made up\nDATA PERIODS,1,1,Data,Sunday,1/1,12/31\n"
    );
    for (month, days) in (1..).zip(DAYS) {
        for (day, hour) in (1..=days).flat_map(|day| (1..=24).map(move |hour| (day, hour))) {
            text += &row(month, day, hour, 0, irradiance(month, hour));
        }
    }
    text
}

/// A line of it.
pub fn row(month: u32, day: u32, hour: u32, minute: u32, [direct, diffuse]: [f64; 2]) -> String {
    format!(
        "2001,{month},{day},{hour},{minute},?9,11,7.5,80,95000,0,0,300,0,{direct},{diffuse},0\n"
    )
}
