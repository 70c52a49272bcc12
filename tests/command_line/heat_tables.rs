//! Boundary conditions as spreadsheets write them.

use super::{case, run, texts, write};

/// The attic's table as it should be, and the same temperatures in other forms.
const PLAIN: &str = "group,temperature,flux,emissivity\nATTIC FLOOR,300,,0.9\n\
                     ROOF SOUTH,340.5,,0.85\n*,320,,0.9\n";

/// The bytes of the table of results with these boundary conditions, or the error.
fn results(known: &[u8], more: &[&str]) -> Result<Vec<u8>, String> {
    let folder = tempfile::tempdir().unwrap();
    let (table, out) = (folder.path().join("k.csv"), folder.path().join("heat.csv"));
    std::fs::write(&table, known).unwrap();
    let attic = case("attic.obj");
    let [table, path] = [&table, &out].map(|path| path.to_str().unwrap());
    let done = run("heat", &[&[&attic, "--boundaries", table, "--out", path], more].concat());
    let [_, error] = texts(&done);
    assert!(!error.contains("panicked"), "{error}");
    if done.status.success() { Ok(std::fs::read(out).unwrap()) } else { Err(error) }
}

fn utf_16(text: &str) -> Vec<u8> {
    [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
}

#[test]
fn tables_of_spreadsheets_are_read() {
    let expected = results(PLAIN.as_bytes(), &[]).unwrap();
    let semicolons = PLAIN.replace(',', ";").replace('.', ",");
    let no_flux = "group,temperature,emissivity\nATTIC FLOOR,300,0.9\nROOF SOUTH,340.5,0.85\n\
                   *,320,0.9\n";
    for text in [
        PLAIN.to_string() + ",,,\n,,,\n",
        PLAIN.to_string() + "\n\n",
        PLAIN.replace('\n', ",,\n"),
        PLAIN.replace('\n', "\r\n"),
        PLAIN.replace('\n', "\r"),
        format!("\u{feff}{PLAIN}"),
        semicolons.clone(),
        semicolons.replace('\n', ";;;\r\n"),
        format!("sep=;\r\n{semicolons}"),
        PLAIN.replace(',', "\t"),
        PLAIN.replace(',', "\t").replace('.', ","),
        // Cells in quotes, and quoted decimal commas.
        format!("\"{}\"\n", PLAIN.trim().replace(',', "\",\"").replace('\n', "\"\n\"")),
        PLAIN.replace("340.5", "\"340,5\"").replace("0.85", "\"0,85\"").replace("0.9", "\"0,9\""),
        PLAIN.replace(',', " , "),
        no_flux.into(),
        // A column that is empty, and one of notes.
        no_flux.replace("emissivity", "emissivity,").replace(".9\n", ".9,\n"),
        no_flux.replace("emissivity", "emissivity,note").replace(".9\n", ".9,hot\n"),
        // Other orders, capitals, units.
        "Emissivity,TEMPERATURE [K],Group\n0.9,300,ATTIC FLOOR\n0.85,340.5,ROOF SOUTH\n\
         0.9,320,*\n"
            .into(),
        PLAIN.replace("flux", "flux [W/m²]").replace("emissivity", "emissivity [-]"),
        PLAIN.replace("flux", "Flux (W/m2)").replace("temperature", "temperature_K"),
        // Lines may end early.
        "emissivity,group,temperature,flux\n0.9,ATTIC FLOOR,300\n0.85,ROOF SOUTH,340.5\n\
         0.9,*,320\n"
            .into(),
    ] {
        match results(text.as_bytes(), &[]) {
            Ok(found) => assert!(found == expected, "{text}"),
            Err(error) => panic!("{error}\n{text}"),
        }
    }
    assert!(results(&utf_16(PLAIN), &[]).unwrap() == expected);
    assert!(results(&utf_16(&PLAIN.replace(',', "\t")), &[]).unwrap() == expected);
}

#[test]
fn names_in_other_encodings_are_the_scenes() {
    let folder = tempfile::tempdir().unwrap();
    let scene =
        write(folder.path(), "s.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\ng Au\u{df}en, links\nf 1 2 3\n");
    let text = "group;temperature;emissivity\n\"Au\u{df}en, links\";300;0,5\n";
    let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let table = folder.path().join("k.csv");
    std::fs::write(&table, latin).unwrap();
    let done = run("heat", &[scene.to_str().unwrap(), "--boundaries", table.to_str().unwrap()]);
    assert!(done.status.success(), "{:?}", texts(&done));
}

#[test]
fn degrees_celsius_are_named_or_asked_for() {
    let celsius =
        "group,temperature,emissivity\nATTIC FLOOR,27,0.9\nROOF SOUTH,67,0.85\n*,47,0.9\n";
    let kelvin = "group,temperature [K],emissivity\nATTIC FLOOR,300.15,0.9\nROOF SOUTH,340.15,\
         0.85\n*,320.15,0.9\n";
    let expected = results(kelvin.as_bytes(), &[]).unwrap();
    let error = results(celsius.as_bytes(), &[]).unwrap_err();
    for word in [
        "k.csv:2:",
        "27 of group 'ATTIC FLOOR'",
        "67 of group 'ROOF SOUTH'",
        "--temperatures celsius",
        "--temperatures kelvin",
    ] {
        assert!(error.contains(word), "{word}: {error}");
    }
    assert!(results(celsius.as_bytes(), &["--temperatures", "celsius"]).unwrap() == expected);
    for unit in [
        "temperature [C]",
        "temperature_C",
        "Temperature (°C)",
        "temperature °C",
        "temperature/degC",
    ] {
        let text = celsius.replace("temperature", unit);
        assert!(results(text.as_bytes(), &[]).unwrap() == expected, "{unit}");
    }
    // As kelvin, if that is said: another result.
    let cold = results(celsius.as_bytes(), &["--temperatures", "kelvin"]).unwrap();
    let named = celsius.replace("temperature", "temperature [K]");
    assert!(cold == results(named.as_bytes(), &[]).unwrap() && cold != expected);
    // One cold cell among others, below zero, zero, and with decimal commas.
    for (cell, name) in [("77", "77"), ("-5", "-5"), ("0", "0"), ("12.5", "12.5")] {
        let text = PLAIN.replace("300", cell);
        let error = results(text.as_bytes(), &[]).unwrap_err();
        assert!(error.contains(&format!("temperature {name} of group 'ATTIC FLOOR'")), "{error}");
    }
    // In degrees Fahrenheit.
    let fahrenheit = "group,temperature [F],emissivity\n*,80.33,0.9\n";
    let kelvin = "group,temperature,emissivity\n*,300,0.9\n";
    let [a, b] = [fahrenheit, kelvin].map(|text| results(text.as_bytes(), &[]).unwrap());
    // (80.33 + 459.67) / 1.8 rounds as 300 does.
    assert!(a == b);
}

#[test]
fn tables_that_may_mean_two_things_are_refused() {
    for (text, words) in [
        ("", &["empty table", "group, temperature"][..]),
        (",,,\n", &["empty table"]),
        // Points and commas; thousands or decimals.
        (
            "group;temperature;emissivity\nATTIC FLOOR;300.5;0.9\n*;300,5;0,9\n",
            &["'300,5'", "'300.5'", "throughout"],
        ),
        ("group,temperature,emissivity\n*,\"1,200\",1\n", &["'1,200'", "thousands"]),
        ("group;temperature;emissivity\n*;1.200,5;1\n", &["'1.200,5'"]),
        // Decimal commas between commas make more cells.
        ("group,temperature,emissivity\n*,300,5,0,9\n", &["'0'", "after the last of 3"]),
        ("group,temperature [R],emissivity\n*,540,1\n", &["temperature in 'R'", "K, C or F"]),
        ("group,flux [kW/m²],emissivity\n*,540,1\n", &["flux in 'kW/m²'", "give W/m²"]),
        ("group,temperature,Temperature,emissivity\n*,300,300,1\n", &["two columns 'temperature'"]),
        ("group,emissivity\n*,1\n", &[":2:", "neither"]),
        ("temperature,emissivity\n300,1\n", &["no column 'group'"]),
        ("group,temperature,emissivity\n*,27 °C,1\n", &[":2:", "'27 °C'", "unit in the header"]),
        ("group,temperature [C],emissivity\n*,-300,1\n", &["temperature -26.85"]),
    ] {
        let error = results(text.as_bytes(), &[]).unwrap_err();
        assert!(words.iter().all(|word| error.contains(word)), "{words:?}: {error}\n{text}");
    }
}
