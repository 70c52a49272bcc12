//! Whether the error that a bake estimated agrees with the measured one.
//!
//! ```text
//! measured − 2 σ > 2 estimated           further off than estimated
//! measured + 2 σ < estimated / 2         less far off than estimated
//! both within estimated / 2 … 2 estimated   they agree; otherwise it is undecided
//! ```

use radiosity::verify::Estimate;

/// Whether the `estimated` error of a bake is within a factor of 2 of the `measured` one, give or
/// take two of its standard errors. Errors below 0.01 % count as that.
pub fn verdict(estimated: Option<f64>, measured: Option<Estimate>) -> Option<String> {
    let Estimate { value, standard_error } = measured.filter(|error| error.value.is_finite())?;
    let estimated = estimated?.max(1e-4);
    let [low, high] = [-2.0, 2.0].map(|k| (value + k * standard_error).max(1e-4));
    Some(if low > 2.0 * estimated {
        let times = value / estimated;
        format!("the solution is {times:.1} times further off than estimated")
    } else if 2.0 * high < estimated {
        format!("the solution is less than {:.2} times as far off as estimated", high / estimated)
    } else if low < estimated / 2.0 || high > 2.0 * estimated {
        "estimated and measured may agree within a factor of 2; measure for longer to be sure"
            .into()
    } else {
        "estimated and measured agree within a factor of 2".into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_knows_what_is_surely_so() {
        let of = |estimated, value, standard_error| {
            verdict(Some(estimated), Some(Estimate { value, standard_error })).unwrap_or_default()
        };
        assert!(of(0.02, 0.021, 0.001).ends_with("agree within a factor of 2"));
        assert!(of(0.01, 0.06, 0.005).contains("6.0 times further off"));
        assert!(of(0.1, 0.01, 0.001).contains("less than 0.12 times as far off"));
        // 1 to 5 %, or 0 to 2 %, where 2 % was estimated.
        assert!(of(0.02, 0.03, 0.01).contains("may agree"));
        assert!(of(0.02, 0.01, 0.005).contains("may agree"));
        // Nothing and next to nothing are the same; what is not finite is no measure.
        assert!(of(0.0, 1e-9, 0.0).ends_with("agree within a factor of 2"));
        assert!(of(1e-17, 1e-3, 0.0).contains("10.0 times further off"));
        assert!(of(0.1, f64::INFINITY, 0.0).is_empty() && verdict(None, None).is_none());
    }
}
