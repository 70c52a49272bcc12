//! `radiosity view-factors` and `radiosity merge`.

use super::{case, run, texts, write};

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
    assert_eq!(rows[0][4..6], ["tent/1 (back)", "tent/2 (back)"]);
    let area = |row: usize| rows[row][8].parse::<f64>().unwrap();
    // A slope of √2 × 1, a row for each of its sides.
    assert!((area(1) - 2.0).abs() < 1e-12, "{csv}");
    assert!([2, 4].iter().all(|&row| (area(row) - 2f64.sqrt()).abs() < 1e-12), "{csv}");
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
    // 17 facets, and the back of one of them.
    for rows in ["0..3", "3..18"] {
        let out = view_factors(&["--rows", rows]);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    }
    let [first, second] = ["0-3", "3-18"]
        .map(|rows| folder.path().join(format!("cornell_box.{rows}.rows")).display().to_string());
    let merged = run("merge", &[&second, &first, "--format", "npz"]);
    assert!(merged.status.success(), "{}", String::from_utf8_lossy(&merged.stderr));
    assert_eq!(std::fs::read(folder.path().join("cornell_box.npz")).unwrap(), whole);
    let alone = run("merge", &[&first]);
    assert_eq!(alone.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&alone.stderr).contains("rows of 15 groups missing"));
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

/// Names of rows and columns of a square table, and its cells.
fn table(path: &std::path::Path) -> (csv::StringRecord, Vec<csv::StringRecord>) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let header = reader.headers().unwrap().clone();
    (header, reader.records().map(Result::unwrap).collect())
}

#[test]
fn groups_called_as_columns_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let square = |name: &str, k: usize| {
        let corners = format!("v 0 0 {k}\nv 1 0 {k}\nv 1 1 {k}\nv 0 1 {k}\n");
        format!("{corners}g {name}\nf -4 -3 -2 -1\n")
    };
    let scene = |name: &str, groups: &[&str]| {
        let text: String = groups.iter().enumerate().map(|(k, g)| square(g, k)).collect();
        write(folder.path(), name, &text)
    };
    for (file, groups, own) in [
        ("a.obj", &["open", "area"][..], ["(open)", "back", "(area)"]),
        ("b.obj", &["back", "(back)"], ["open", "((back))", "area"]),
        ("c.obj", &["x", "open", "(open)", "area"], ["((open))", "back", "(area)"]),
        ("d.obj", &["x", "y"], ["open", "back", "area"]),
    ] {
        let path = scene(file, groups);
        let out = run("view-factors", &[path.to_str().unwrap()]);
        let [said, warned] = texts(&out);
        assert!(out.status.success(), "{warned}");
        let (header, rows) = table(&path.with_extension("csv"));
        let names: Vec<&str> = header.iter().skip(1).collect();
        assert_eq!(names, [groups, &own].concat());
        assert_eq!(rows.iter().map(|row| &row[0]).collect::<Vec<_>>(), groups);
        // Rows sum to one with the table's own columns.
        for row in &rows {
            let shares = row.iter().skip(1).take(groups.len() + 2);
            let sum: f64 = shares.map(|cell| cell.parse::<f64>().unwrap()).sum();
            // Each has nine decimals.
            assert!((sum - 1.0).abs() < 5e-10 * header.len() as f64, "{row:?}");
        }
        let (_, list) = table(&path.with_extension("list.csv"));
        let ends = |own: &str| list.iter().filter(|line| &line[1] == own).count();
        assert_eq!([own[0], own[1]].map(ends), [groups.len(); 2], "{list:?}");
        assert!(said.contains(&format!("→ {}", own[0])), "{said}");
        let renamed = own.iter().filter(|name| name.starts_with('(')).count();
        assert_eq!(warned.matches("the column of this name is").count(), renamed, "{warned}");
    }
}

#[test]
fn flux_that_meets_backs_is_named_with_its_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let sheet = case("sheet.obj");
    let with = |scene: &str, more: &[&str]| {
        let done = run("view-factors", &[&[scene, "--out", out], more].concat());
        assert!(done.status.success(), "{:?}", texts(&done));
        texts(&done)
    };
    let [said, warned] = with(&sheet, &[]);
    // Part of the floor is on the sheet's dark side.
    let words = [
        "backs of surfaces",
        "floor 6.993 %",
        "5 of 7",
        "--two-sided \"partition_east_side\"",
        "wrong order",
    ];
    assert!(words.iter().all(|word| warned.contains(word)), "{warned}");
    assert!(!said.contains("closed"), "{said}");
    let [said, warned] = with(&sheet, &["--two-sided", "partition_east_side"]);
    assert!(said.contains("closed") && warned.is_empty(), "{said} {warned}");
    // A wall that faces out, two sheets, and a merged matrix, whose scene is not there.
    let text = std::fs::read_to_string(&sheet).unwrap();
    let turned = text.replace("f 21 22 23 24", "f 24 23 22 21");
    let turned = write(folder.path(), "turned.obj", &turned);
    let [_, warned] = with(turned.to_str().unwrap(), &["--two-sided", "partition_east_side"]);
    assert!(warned.contains("at that of east") && warned.contains("see out"), "{warned}");
    let more = "v 1 0 0\nv 1 4 0\nv 1 4 1\nv 1 0 1\ng low\nf -4 -3 -2 -1\n";
    let two = write(folder.path(), "two.obj", &(text + more));
    let [_, warned] = with(two.to_str().unwrap(), &[]);
    let options = ["--two-sided \"low\"", "--two-sided \"partition_east_side\""];
    assert!(options.iter().any(|option| warned.contains(option)), "{warned}");
    let [_, warned] = with(two.to_str().unwrap(), &["--two-sided", "low"]);
    assert!(!warned.contains(options[0]) && warned.contains(options[1]), "{warned}");
    with(&sheet, &["--rows", "0..7"]);
    let rows = folder.path().join("sheet.0-7.rows");
    let merged = run("merge", &[rows.to_str().unwrap()]);
    let [_, warned] = texts(&merged);
    assert!(warned.contains("--two-sided") && warned.contains("floor 6.993 %"), "{warned}");
}

#[test]
fn rounding_exceeds_no_bounds() {
    // All of the floor's flux arrives at the shell around it: 1, and a few ε more by rounding.
    let folder = tempfile::tempdir().unwrap();
    for (k, size) in
        [[0.217, 7.553, 2.408], [7.545, 4.34, 5.788], [4.307, 6.498, 7.921], [2.031, 8.693, 3.982]]
            .into_iter()
            .enumerate()
    {
        let [a, b, c] = size;
        let ring = |z: f64| format!("v 0 0 {z}\nv {a} 0 {z}\nv {a} {b} {z}\nv 0 {b} {z}\n");
        let shell = "f 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
        let text = format!("{}{}g floor\nf 1 2 3 4\ng shell\n{shell}", ring(0.0), ring(c));
        let scene = write(folder.path(), &format!("{k}.obj"), &text);
        let [said, _] = texts(&run("view-factors", &[scene.to_str().unwrap()]));
        assert!(said.contains("bounds: kept"), "{size:?}: {said}");
    }
}
