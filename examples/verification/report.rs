//! The report as Markdown.

use std::fmt::Write;

use crate::case::{Case, Section};

const HEAD: &str = "# Verification

Cases with known answers, closed forms, published values and path-traced values, and what the crate
computes. Written by

```sh
cargo run --release --features cli --example verification
```

which fails if a case is outside its band; CI runs it. Adapter: none, rays on the CPU
(`Backend::Cpu`). Deviation is (here − right)/right; where the right value is 0, here − right. The
band is the largest |here − right| allowed, and follows from what stands under each title. FAILED
marks cases outside it.

![Deviation over band, a dot for each case](verification.png)
";

/// The whole report.
pub fn markdown(sections: &[Section]) -> String {
    let mut text = HEAD.to_string();
    let cases = sections.iter().flat_map(|section| &section.cases);
    let passed = cases.clone().filter(|case| case.is_passed()).count();
    let _ = writeln!(text, "\n{passed} of {} cases passed.", cases.count());
    for section in sections {
        let _ = writeln!(text, "\n## {}\n\nBands. {}\n", section.title, section.bands);
        text += "| | case | source | quantity | right | here | deviation | band ± | |\n";
        text += "|---|---|---|---|---|---|---|---|---|\n";
        for (number, case) in (1..).zip(&section.cases) {
            text += &line(number, case);
        }
    }
    text
}

fn line(number: usize, case: &Case) -> String {
    let Case { name, source, quantity, right, here, band } = case;
    let passed = if case.is_passed() { "passed" } else { "**FAILED**" };
    let deviation = case.deviation();
    let deviation = match *right {
        0.0 if deviation == 0.0 => "0".into(),
        0.0 => format!("{deviation:.1e}"),
        right => percent(100.0 * deviation / right),
    };
    let name = name.replace('|', "\\|");
    let [right, here] = [right, here].map(|value| digits(*value));
    let band = if *band == 0.0 { "0".into() } else { format!("{band:.1e}") };
    format!(
        "| {number} | {name} | {source} | {quantity} | {right} | {here} | {deviation} | {band} | \
         {passed} |\n"
    )
}

/// Seven digits.
fn digits(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let exponent = value.abs().log10().floor();
    if (-4.0..6.0).contains(&exponent) {
        let text = format!("{value:.*}", (6.0 - exponent) as usize);
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        format!("{value:.6e}")
    }
}

/// Percent; what is smaller than 1e-4 with an exponent.
fn percent(value: f64) -> String {
    match value.abs() {
        0.0 => "0 %".into(),
        1e-4.. => format!("{value:.4} %"),
        _ => format!("{value:.0e} %"),
    }
}
