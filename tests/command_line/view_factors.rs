//! `radiosity view-factors` and `radiosity heat`.

use super::{run, write};

#[test]
fn view_factors_writes_a_matrix_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let plates = "o low\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n\
                  o high\nv 0 0 1\nv 0 1 1\nv 1 1 1\nv 1 0 1\nf 5 6 7 8\n";
    let scene = write(folder.path(), "plates.obj", plates);
    let out = run("view-factors", &[scene.to_str().unwrap()]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let csv = std::fs::read_to_string(folder.path().join("plates.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!(rows[0], ["F from row to column", "low", "high", "open", "back", "area"]);
    assert_eq!(rows[1][0], "low");
    // Known to five digits.
    assert!((rows[1][2].parse::<f64>().unwrap() - 0.19982).abs() < 1e-5, "{csv}");
    assert!((rows[2][3].parse::<f64>().unwrap() - 0.80018).abs() < 1e-5, "{csv}");
}

#[test]
fn view_factors_of_facets_are_a_row_a_face() {
    let folder = tempfile::tempdir().unwrap();
    // A tent of two slopes over a floor: the slopes, two-sided, are facets of one group.
    let tent = "o floor\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4\n\
                o tent\nv 1 0 1\nv 1 1 1\nf 1 5 6 4\nf 2 3 6 5\n";
    let scene = write(folder.path(), "tent.obj", tent);
    let scene = scene.to_str().unwrap();
    let out = run("view-factors", &[scene, "--facets", "--two-sided", "tent"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let csv = std::fs::read_to_string(folder.path().join("tent.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!(rows[0][1..4], ["floor/1", "tent/1", "tent/2"]);
    let area = |row: usize| rows[row][6].parse::<f64>().unwrap();
    // A slope of √2 × 1 has both its sides.
    assert!((area(1) - 2.0).abs() < 1e-12 && (area(2) - 8f64.sqrt()).abs() < 1e-12, "{csv}");
    let out = run("view-factors", &[scene, "--facets", "--two-sided", "tarp"]);
    let error = String::from_utf8_lossy(&out.stderr);
    assert!(error.contains("'tarp'") && error.contains("floor/1, tent/1, tent/2"), "{error}");
    assert_eq!(out.status.code(), Some(1));
}

#[test]
fn sparse_rows_for_scipy_read_back() {
    let folder = tempfile::tempdir().unwrap();
    // A floor, a lid over its left half, and a wall behind the lid's back.
    let text = "o floor\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4\n\
                o lid\nv 0 0 1\nv 0 1 1\nv 1 1 1\nv 1 0 1\nf 5 6 7 8\n\
                o above\nv 0 0 2\nv 0 1 2\nv 1 1 2\nv 1 0 2\nf 9 10 11 12\n";
    let scene = write(folder.path(), "lids.obj", text);
    let arguments = ["--format", "npz,csv", "--check", "3"];
    let out = run("view-factors", &[&[scene.to_str().unwrap()][..], &arguments].concat());
    let said = String::from_utf8_lossy(&out.stdout);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    // Exact rows against an exact matrix.
    assert!(said.contains("of 3 rows") && said.contains("100.00 % within two"), "{said}");
    let file = std::fs::File::open(folder.path().join("lids.npz")).unwrap();
    let mut archive = zip::ZipArchive::new(file).unwrap();
    let mut bytes = |name: &str| {
        let mut bytes = vec![];
        let mut array = archive.by_name(&format!("{name}.npy")).unwrap();
        std::io::Read::read_to_end(&mut array, &mut bytes).unwrap();
        bytes
    };
    let format = bytes("format");
    assert!(format.ends_with(b"csr") && String::from_utf8_lossy(&format).contains("'|S3'"));
    fn numbers<T: npyz::Deserialize>(bytes: &[u8]) -> Vec<T> {
        npyz::NpyFile::new(bytes).unwrap().into_vec().unwrap()
    }
    assert_eq!(numbers::<i64>(&bytes("shape")), [3, 3]);
    let starts: Vec<i64> = numbers(&bytes("indptr"));
    let columns: Vec<i32> = numbers(&bytes("indices"));
    let (values, errors): (Vec<f64>, Vec<f64>) =
        (numbers(&bytes("data")), numbers(&bytes("standard_error")));
    let csv = std::fs::read_to_string(folder.path().join("lids.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().skip(1).map(|l| l.split(',').collect()).collect();
    let number = |row: usize, column: usize| rows[row][column].parse::<f64>().unwrap();
    let mut nonzeros = 0;
    for i in 0..3 {
        let row = starts[i] as usize..starts[i + 1] as usize;
        nonzeros += row.len();
        for k in row {
            // The table has nine decimals.
            assert!((values[k] - number(i, 1 + columns[k] as usize)).abs() < 1e-9, "{csv}");
            assert!(errors[k] >= 0.0 && errors[k] < 1e-4);
        }
        for (name, column) in [("open", 4), ("back", 5), ("area", 6)] {
            let all: Vec<f64> = numbers(&bytes(name));
            assert!((all[i] - number(i, column)).abs() < 1e-9, "{name} {csv}");
        }
    }
    let in_table = (0..3).map(|i| (1..4).filter(|j| number(i, *j) > 0.0).count()).sum();
    assert_eq!((nonzeros, columns.len(), values.len()), (in_table, in_table, in_table));
}

#[test]
fn square_tables_of_many_facets_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    // One more than there may be.
    let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", "f 1 2 3\n".repeat(8193));
    let scene = write(folder.path(), "stack.obj", &text);
    for format in ["csv", "npy"] {
        let out = run("view-factors", &[scene.to_str().unwrap(), "--facets", "--format", format]);
        let error = String::from_utf8_lossy(&out.stderr);
        let words = ["8193 groups", "above 8192 take", "list", "mtx"];
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
        assert_eq!(out.status.code(), Some(1));
        assert!(!folder.path().join(format!("stack.{format}")).exists());
    }
}

/// A floor, and above it a lid as large, both of 1 m², 1 m apart.
const TWO_SQUARES: &str = "o floor\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n\
                           o lid\nv 0 0 1\nv 0 1 1\nv 1 1 1\nv 1 0 1\nf 5 6 7 8\n";

#[test]
fn heat_of_a_scene_and_of_its_view_factors() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write(folder.path(), "squares.obj", TWO_SQUARES);
    let boundaries = write(
        folder.path(),
        "known.csv",
        "Group, temperature, flux, emissivity\nfloor/1, 500, , 1\n*, , 0, 0.3\n",
    );
    let [scene, boundaries] = [&scene, &boundaries].map(|path| path.to_str().unwrap());
    let out = run("view-factors", &[scene, "--facets", "--format", "npz"]);
    assert!(out.status.success());
    let matrix = scene.replace(".obj", ".npz");
    for input in [&[scene, "--facets"][..], &[&matrix]] {
        let known = ["--boundaries", boundaries, "--surroundings", "300"];
        let out = run("heat", &[input, &known].concat());
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let mut table = csv::Reader::from_path(scene.replace(".obj", ".heat.csv")).unwrap();
        let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
        assert_eq!([&rows[0][0], &rows[1][0]], ["floor/1", "lid/1"]);
        let number = |row: usize, column: usize| rows[row][column].parse::<f64>().unwrap();
        // Opposite faces of a cube see 0.19982490 of each other. What is adiabatic is as warm as
        // what it sees: σT⁴ = F σ 500⁴ + (1 − F) σ 300⁴.
        let (f, [hot, cold]) = (0.199_824_896, [500f64.powi(4), 300f64.powi(4)]);
        let temperature = (f * hot + (1.0 - f) * cold).powf(0.25);
        assert!((number(1, 2) - temperature).abs() < 1e-5, "{rows:?}");
        let flux = 5.670374419e-8 * (1.0 - f * f) * (hot - cold);
        assert!((number(0, 5) - flux).abs() < 1e-4, "{rows:?}");
        assert_eq!((number(1, 5), number(0, 1)), (0.0, 1.0));
    }
}

#[test]
fn boundaries_that_say_nothing_are_refused_with_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write(folder.path(), "squares.obj", TWO_SQUARES);
    let head = "group,temperature,flux,emissivity\n";
    for (text, words) in [
        ("group,temperature,flux\n", &["no column 'emissivity'"][..]),
        ("floor,1,1,1\n", &[":2:", "temperature and flux"]),
        ("floor,,,1\n", &[":2:", "neither"]),
        ("floor,1,,1\nlid,1,,x\n", &[":3:", "emissivity 'x'", "give a number"]),
        ("floor,1,,1\nlid,1,,\n", &[":3:", "no emissivity"]),
        ("floor,1,,1\nfloor,2,,1\n", &[":3:", "'floor' a second time"]),
        ("floor,1,,1\n", &["nothing of group 'lid'"]),
        ("roof,1,,1\n*,1,,1\n", &[":2:", "group 'roof'", "not there"]),
        ("floor,1,,1\nlid,1,,7\n", &["group 'lid'", "emissivity 7"]),
    ] {
        let text = if text.starts_with("group") { text.into() } else { format!("{head}{text}") };
        let known = write(folder.path(), "known.csv", &text);
        let [scene, known] = [&scene, &known].map(|path| path.to_str().unwrap());
        let out = run("heat", &[scene, "--boundaries", known]);
        let error = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(1));
        assert!(words.iter().all(|word| error.contains(word)), "{words:?}: {error}");
    }
}

#[test]
fn what_takes_more_memory_than_allowed_is_refused_beforehand() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let with = |gib| run("view-factors", &[super::cornell(), "--memory", gib, "--out", out]);
    let refused = with("1e-6");
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(1));
    // Objects: their pairs.
    assert!(said.contains("--memory: about 64 factors") && said.contains("--error"), "{said}");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
    assert!(with("1").status.success());
}

#[test]
fn rows_of_many_machines_merge_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let cornell = super::cornell();
    let out = folder.path().to_str().unwrap();
    let common = [cornell, "--facets", "--two-sided", "light", "--out", out];
    let view_factors = |more: &[&str]| run("view-factors", &[&common, more].concat());
    assert!(view_factors(&["--format", "npz"]).status.success());
    let whole = std::fs::read(folder.path().join("cornell_box.npz")).unwrap();
    for rows in ["0..3", "3..17"] {
        let out = view_factors(&["--rows", rows]);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    }
    let [first, second] = ["0-3", "3-17"]
        .map(|rows| folder.path().join(format!("cornell_box.{rows}.rows")).display().to_string());
    let merged = run("merge", &[&second, &first, "--format", "npz"]);
    assert!(merged.status.success(), "{}", String::from_utf8_lossy(&merged.stderr));
    assert_eq!(std::fs::read(folder.path().join("cornell_box.npz")).unwrap(), whole);
    let alone = run("merge", &[&first]);
    assert_eq!(alone.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&alone.stderr).contains("rows of 14 groups missing"));
    // A checkpoint is gone on from: rows are there already.
    let out = view_factors(&["--checkpoint", &first, "--format", "npz"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    assert_eq!(std::fs::read(folder.path().join("cornell_box.npz")).unwrap(), whole);
    let complete = run("merge", &[&first, "--format", "npz"]);
    assert!(complete.status.success(), "the checkpoint has all rows now");
    let other = view_factors(&["--checkpoint", &first, "--error", "1e-3"]);
    assert_eq!(other.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&other.stderr).contains("of other settings"));
    for (more, words) in [
        (&["--rows", "5..5"][..], "A..B"),
        (&["--rows", "0..2", "--enforce"], "'--enforce'"),
        (&["--checkpoint", "x", cornell], "one scene"),
        (&["--memory", "0"], "GiB"),
    ] {
        let out = view_factors(more);
        assert_eq!(out.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&out.stderr).contains(words));
    }
}
