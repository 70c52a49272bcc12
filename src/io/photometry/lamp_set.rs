//! The sets of lamps of a EULUMDAT file: each is what the luminaire may be equipped with, so that
//! one of them shines. Intensities are per 1000 lm of the lamps of any of them.

use super::name_of;

/// A set of lamps.
#[derive(Clone, Default)]
pub struct LampSet {
    /// From 1.
    number: usize,
    name: String,
    /// Of all lamps of the set, lm; 0 if the file does not give it.
    pub flux: f64,
    /// Whether the intensities are those of the luminaire itself.
    pub is_absolute: bool,
    /// W; 0 if the file does not give it.
    pub power: f64,
}

impl LampSet {
    /// Lines of a set in the file: number of lamps, kind, flux, colour, rendering, watts.
    pub const LINES: usize = 6;

    /// Set `index`, from 0, by the text and the number of the lines of all sets.
    pub fn new(
        index: usize,
        text: impl Fn(usize) -> String,
        number: impl Fn(usize) -> f64,
    ) -> Self {
        let first = LampSet::LINES * index;
        let lamps = number(first);
        LampSet {
            number: index + 1,
            name: name_of(&text(first + 1)),
            flux: number(first + 2).abs(),
            is_absolute: lamps < 0.0,
            power: number(first + 5).max(0.0),
        }
    }

    /// Whether a luminaire with these lamps shines as with the `other` ones.
    fn shines_as(&self, other: &LampSet) -> bool {
        self.flux == other.flux && self.is_absolute == other.is_absolute
    }
}

/// The set that is `chosen`, from 1, or the first if all shine alike; with no set, one without
/// flux.
///
/// # Errors
/// What was found, and the remedy, where there is no such set or none is chosen.
pub fn choose(sets: &[LampSet], chosen: Option<usize>) -> Result<LampSet, (String, String)> {
    let Some(first) = sets.first() else { return Ok(LampSet::default()) };
    let is_alike = sets.iter().all(|set| set.shines_as(first));
    let set = match chosen {
        Some(number) if sets.len() > 1 => sets.iter().find(|set| set.number == number),
        _ => Some(first).filter(|_| is_alike),
    };
    set.cloned().ok_or_else(|| {
        let list = sets.iter().map(|set| {
            let LampSet { number, name, flux, power, .. } = set;
            format!("{number}: {name}, {flux} lm, {power} W")
        });
        let list = list.collect::<Vec<_>>().join("; ");
        let found = format!("{} sets of lamps, one of which shines: {list}", sets.len());
        (found, format!("choose one with --lamp-set 1 to {}", sets.len()))
    })
}
