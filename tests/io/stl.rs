use radiosity::io::{SceneSettings, read_scene};
use radiosity::scene::WarningKind;
use radiosity::{ErrorKind, Scene};

/// Two solids, written as different programs do.
const ASCII: &str = "\
solid lower half
  facet normal 0 0 1
    outer loop
      vertex 0 0 0
      vertex 1.0000000001 0 0
      vertex 0 1e0 0
    endloop
  endfacet
endsolid lower half
SOLID
  FACET NORMAL 0 0 -1
    OUTER LOOP
      VERTEX 0 0 1
      VERTEX 0 1 1
      VERTEX 1 0 1
    ENDLOOP
  ENDFACET
ENDSOLID
";

fn read(bytes: &[u8]) -> Scene {
    read_scene("part.STL", bytes, &[]).unwrap()
}

/// A binary file of these triangles, normal and corners each, that says there are `count`.
fn binary(triangles: &[[[f32; 3]; 4]], count: u32) -> Vec<u8> {
    let mut bytes = b"solid in name only".to_vec();
    bytes.resize(80, b' ');
    bytes.extend(count.to_le_bytes());
    for triangle in triangles {
        bytes.extend(triangle.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([7, 7]);
    }
    bytes
}

const UP: [[f32; 3]; 4] = [[0.0, 0.0, 1.0], [0.0, 0.0, 0.1], [1.0, 0.0, 0.1], [0.0, 1.0, 0.1]];

fn kinds(scene: &Scene) -> Vec<WarningKind> {
    scene.warnings().iter().map(|w| w.kind).collect()
}

#[test]
fn solids_are_groups_and_digits_are_kept() {
    for text in [ASCII.to_string(), ASCII.replace('\n', "\r\n"), ASCII.replace('\n', "\r")] {
        let scene = read(text.as_bytes());
        assert_eq!(scene.groups(), ["lower half", "default"]);
        assert_eq!(scene.triangles().len(), 2);
        assert_eq!(scene.corners(0)[1].x, 1.0000000001);
        let kept = [WarningKind::FaceWithoutMaterial, WarningKind::NoLight];
        assert!(kinds(&scene).iter().all(|kind| kept.contains(kind)), "{:?}", scene.warnings());
    }
    let utf_16: Vec<u8> = ASCII.encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_eq!(read(&utf_16).triangles().len(), 2);
}

#[test]
fn binary_files_have_a_group_of_their_name() {
    let scene = read(&binary(&[UP, UP.map(|[x, y, z]| [x, y, z + 1.0])], 2));
    assert_eq!((scene.groups(), scene.triangles().len()), (&["part".to_string()][..], 2));
    assert_eq!(scene.corners(0)[0].z, 0.1);
    let mut facets = SceneSettings::default();
    facets.facets = true;
    let scene = facets.read("part.stl", &binary(&[UP, UP], 2), &[]).unwrap();
    assert_eq!(scene.groups(), ["part/1", "part/2"]);
}

#[test]
fn counts_that_are_wrong_are_said() {
    // Said, there, bytes too many, read.
    for (said, there, more, expected) in [(0, 3, 0, 3), (9, 3, 17, 3), (2, 3, 0, 2), (3, 3, 5, 3)] {
        let mut bytes = binary(&vec![UP; there], said);
        bytes.extend(vec![1; more]);
        let scene = read(&bytes);
        assert_eq!(scene.triangles().len(), expected);
        assert!(kinds(&scene).contains(&WarningKind::BrokenOff));
        let mut strict = SceneSettings::default();
        strict.strict = true;
        let error = strict.read("part.stl", &bytes, &[]).unwrap_err();
        assert!(error.to_string().contains("give the whole file"), "{error}");
    }
}

#[test]
fn facets_that_break_off_are_left_out() {
    let cut = &ASCII[..ASCII.find("      VERTEX 1 0 1").unwrap()];
    let scene = read(cut.as_bytes());
    assert_eq!(scene.triangles().len(), 1);
    assert!(kinds(&scene).contains(&WarningKind::BrokenOff));
}

#[test]
fn normals_that_contradict_corners_are_said() {
    let turned = ASCII.replace("normal 0 0 1", "normal 0 0 -1");
    let mut down = UP;
    down[0][2] = -1.0;
    for (bytes, place) in
        [(turned.into_bytes(), "part.STL:7"), (binary(&[UP, down], 2), "part.STL: triangle 2")]
    {
        let scene = read(&bytes);
        let warning = scene.warnings().iter().find(|w| w.kind == WarningKind::OpposedNormal);
        assert_eq!(warning.unwrap().place.as_deref(), Some(place));
    }
}

#[test]
fn what_cannot_be_meant_is_refused_with_its_place() {
    let mut infinite = UP;
    infinite[2][1] = f32::INFINITY;
    let box_of_obj = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".repeat(10);
    let three_lines = &ASCII[..ASCII.find("      vertex").unwrap()];
    for (bytes, found) in [
        (ASCII.replace("1e0", "one").into_bytes(), "part.STL:6: coordinate 'one'"),
        (ASCII.replace(" 1e0 0", "").into_bytes(), "part.STL:6: 1 words"),
        (binary(&[UP, infinite], 2), "part.STL: triangle 2: coordinates [1, inf"),
        (binary(&[], 0), "no face"),
        (three_lines.into(), "no face, 0 vertices; give an STL file with facets"),
        (box_of_obj, "neither a facet nor a binary header"),
        (vec![], "neither a facet nor a binary header"),
    ] {
        let error = read_scene("part.STL", &bytes, &[]).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Scene);
        assert!(error.to_string().contains(found), "{error}");
    }
}
