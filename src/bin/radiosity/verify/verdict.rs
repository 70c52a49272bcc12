//! Whether the error that a bake told is the one that was measured.
//!
//! ```text
//! measured − 2 σ > 2 told    further off than it tells
//! measured + 2 σ < told / 2  not nearly as far off as it tells
//! both within told / 2 … 2 told    they agree; else nobody knows yet
//! ```

use radiosity::verify::Estimate;

/// An error that nobody asks to be told more exactly: 0.01 %.
const NEGLIGIBLE: f64 = 1e-4;

/// Whether the error `told` by the bake is within a factor of 2 of the one `measured`, give or take
/// two of its standard errors. What is below [`NEGLIGIBLE`] is as good as that.
pub fn verdict(told: Option<f64>, measured: Option<Estimate>) -> Option<String> {
    let Estimate { value, standard_error } = measured.filter(|error| error.value.is_finite())?;
    let told = told?.max(NEGLIGIBLE);
    let [low, high] = [-2.0, 2.0].map(|k| (value + k * standard_error).max(NEGLIGIBLE));
    Some(if low > 2.0 * told {
        let times = value / told;
        format!("the solution is {times:.1} times further off than it tells")
    } else if 2.0 * high < told {
        format!("the solution is less than {:.2} times as far off as it tells", high / told)
    } else if low < told / 2.0 || high > 2.0 * told {
        "told and measured may agree within a factor of 2; measure for longer to be sure".into()
    } else {
        "told and measured agree within a factor of 2".into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_knows_what_is_surely_so() {
        let of = |told, value, standard_error| {
            verdict(Some(told), Some(Estimate { value, standard_error })).unwrap_or_default()
        };
        assert!(of(0.02, 0.021, 0.001).ends_with("agree within a factor of 2"));
        assert!(of(0.01, 0.06, 0.005).contains("6.0 times further off"));
        assert!(of(0.1, 0.01, 0.001).contains("less than 0.12 times as far off"));
        // 1 to 5 %, or 0 to 2 %, where 2 % was told.
        assert!(of(0.02, 0.03, 0.01).contains("may agree"));
        assert!(of(0.02, 0.01, 0.005).contains("may agree"));
        // Nothing and next to nothing are the same; what is not finite is no measure.
        assert!(of(0.0, 1e-9, 0.0).ends_with("agree within a factor of 2"));
        assert!(of(1e-17, 1e-3, 0.0).contains("10.0 times further off"));
        assert!(of(0.1, f64::INFINITY, 0.0).is_empty() && verdict(None, None).is_none());
    }
}
