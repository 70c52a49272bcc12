"""Wrong input: each is a ValueError that says where, what was found and what would be right."""

import datetime

import numpy as np
import pytest
from conftest import CUBE, SIDES

import radiosity


def cube(**changes):
    """A scene of the cube with some arguments replaced."""
    arguments = {"vertices": CUBE, "faces": SIDES, **changes}
    return radiosity.Scene(arguments.pop("vertices"), arguments.pop("faces"), **arguments)


def with_nan():
    vertices = CUBE.copy()
    vertices[3, 1] = np.nan
    return vertices


def out_of_range(index):
    faces = SIDES.copy()
    faces[2, 3] = index
    return faces


def by_face(value):
    reflectance = np.full(6, 0.5)
    reflectance[4] = value
    return reflectance


@pytest.fixture(scope="module")
def light():
    return radiosity.bake(cube(exitance=1.0), 0.3, device="cpu")


@pytest.fixture(scope="module")
def factors():
    return radiosity.view_factors(CUBE, SIDES)


CASES = [
    # Arrays of vertices.
    (lambda: cube(vertices="cube"), "vertices: a str", "shape (n, 3)"),
    (lambda: cube(vertices=None), "vertices: a NoneType", "shape (n, 3)"),
    (lambda: cube(vertices=CUBE[:, :2]), "vertices: shape (8, 2)", "shape (n, 3)"),
    (lambda: cube(vertices=CUBE.ravel()), "vertices: shape (24,)", "shape (n, 3)"),
    (lambda: cube(vertices=np.empty((0, 3))), "vertices: no rows", "at least one"),
    (lambda: cube(vertices=with_nan()), "vertices[3, 1]: nan", "finite"),
    (lambda: cube(vertices=np.full((8, 3), np.inf)), "vertices[0, 0]: inf", "finite"),
    (lambda: cube(vertices=CUBE.astype(complex)), "numbers of type complex128", "shape (n, 3)"),
    (lambda: cube(vertices=CUBE.astype(bool)), "numbers of type bool", "shape (n, 3)"),
    (lambda: cube(vertices=CUBE.astype(str)), "numbers of type <U", "shape (n, 3)"),
    (lambda: cube(vertices=[[0, 0, 0], [1, 0]]), "rows of different lengths", "shape (n, 3)"),
    (lambda: cube(vertices=[[None] * 3] * 8), "objects that are not numbers", "shape (n, 3)"),
    # Faces.
    (lambda: cube(faces=SIDES[:, :2]), "faces: shape (6, 2)", "(m, 3) or (m, 4)"),
    (lambda: cube(faces=[4, 0, 1, 2, 3]), "faces: shape (5,)", "pyvista"),
    (lambda: cube(faces=SIDES.astype(float)), "faces: numbers of type float64", "astype(int)"),
    (lambda: cube(faces=out_of_range(8)), "faces[2, 3]: vertex 8 of 8", "from 0 to 7"),
    (lambda: cube(faces=out_of_range(-1)), "faces[2, 3]: vertex -1 of 8", "from 0 to 7"),
    (lambda: cube(faces=np.empty((0, 3), int)), "faces: no rows", "at least one"),
    (lambda: cube(faces=[[0, 0, 0]]), "1 triangles, none with area", "at least one"),
    # Materials and groups.
    (lambda: cube(reflectance=1.0), "reflectance: 1.0", "below 1"),
    (lambda: cube(reflectance=-0.1), "reflectance: -0.1", "at least 0"),
    (lambda: cube(reflectance=by_face(1.5)), "reflectance of face 4: 1.5", "below 1"),
    (lambda: cube(reflectance=by_face(np.nan)), "reflectance[4]: nan", "finite"),
    (lambda: cube(reflectance="white"), "reflectance: a str", "a number"),
    (lambda: cube(reflectance=np.zeros((5, 3))), "reflectance: shape (5, 3)", "(6, 3)"),
    (lambda: cube(exitance=-1.0), "exitance: -1.0", "at least 0"),
    (lambda: cube(transmittance=0.6), "transmittance of face 0", "below 1 together"),
    (lambda: cube(groups=["a"]), "groups: 1 of them", "each of 6 faces"),
    (lambda: cube(groups="abcdef"), "groups: 'abcdef'", "for each face"),
    (lambda: cube(groups=[1.5] * 6), "groups[0]: a float", "whole numbers"),
    # Light from outside.
    (lambda: cube(sky=1.0), "sky: a float", "Sky.uniform"),
    (lambda: cube(up=[0, 0, 0]), "up: 0, 0, 0", "direction"),
    (lambda: radiosity.Sky.uniform([1, 2]), "radiance: shape (2,)", "red, green and blue"),
    (lambda: radiosity.Sky.uniform(-1), "radiance: -1", "at least 0"),
    (lambda: radiosity.Sky.cie(17), "number: 17", "from 1 to 16"),
    (lambda: radiosity.Sky(), "Sky()", "Sky.uniform"),
    (lambda: radiosity.Sky.perez(-1, 0, [0, 0, 1]), "direct_normal: -1", "at least 0"),
    (lambda: radiosity.Sky.picture(np.ones((2, 2))), "pixels: shape (2, 2)", "columns, 3)"),
    (
        lambda: radiosity.sun_direction(datetime.datetime(2024, 1, 1), 0, 0),
        "when: a time without a time zone",
        "tzinfo",
    ),
    (lambda: radiosity.sun_direction("noon", 0, 0), "when: a str", "datetime.datetime"),
    # Bakes.
    (lambda: radiosity.bake(cube(), error=0), "error: 0", "above 0 and below 1"),
    (lambda: radiosity.bake(cube(), error=5), "error: 5", "above 0 and below 1"),
    (lambda: radiosity.bake(cube(), error="5 %"), "error: '5 %'", "a number"),
    (lambda: radiosity.bake(cube(), error=np.nan), "error: nan", "a number"),
    (lambda: radiosity.bake(cube(), time=-1), "time: -1", "above 0"),
    (lambda: radiosity.bake(cube(), threads=0), "threads: 0", "from 1 to 1024"),
    (lambda: radiosity.bake(cube(), threads=True), "threads: True", "from 1 to 1024"),
    (lambda: radiosity.bake(cube(), progress=3), "progress: a int", "function"),
    (lambda: radiosity.bake(cube(), device=None), "device: None", "'cpu'"),
    (lambda: radiosity.bake(3), "scene: a int", "trimesh"),
    (lambda: radiosity.Scene.load(3), "file: a int", "path, or bytes"),
    (lambda: radiosity.Scene.load(b"v 0 0 x\nf 1 1 1", name="a.obj"), "a.obj:1", ""),
    # Factors and heat.
    (lambda: radiosity.view_factors(CUBE), "without faces", "give vertices and faces"),
    (lambda: radiosity.view_factors(cube(), SIDES), "faces: given with a Scene", "leave them"),
    (lambda: radiosity.view_factors(CUBE, SIDES, 0), "error: 0", "above 0"),
    (lambda: radiosity.view_factors(CUBE, SIDES, method="best"), "method: 'best'", "'sparse'"),
]


@pytest.mark.parametrize("case", range(len(CASES)))
def test_wrong_input_gets_a_clear_error(case):
    call, found, remedy = CASES[case]
    with pytest.raises(ValueError) as error:
        call()
    message = str(error.value)
    assert found in message and remedy in message and "\n" not in message, message


def test_wrong_input_to_what_was_made(light, factors):
    cases = [
        (lambda: radiosity.grid(3), "light: a int", "radiosity.bake"),
        (lambda: radiosity.grid(light, plane=CUBE), "plane: shape (8, 3)", "two edges"),
        (lambda: radiosity.grid(light, plane=np.zeros((3, 3))), "measuring plane", "not parallel"),
        (lambda: radiosity.grid(light, group="none"), "none", ""),
        (lambda: radiosity.probes(light, positions=CUBE), "size: None", "distance"),
        (lambda: radiosity.probes(light, counts=(0, 1, 1)), "counts: (0, 1, 1)", "above 0"),
        (lambda: radiosity.verify(cube(), CUBE[0, 0]), "solution: a float64", "give a Bake"),
        (lambda: radiosity.verify(cube(), (CUBE, SIDES[:, :3], CUBE[:3])), "3 rows for 8", "one"),
        (lambda: light.picture((0, 1)), "size: 0", "at least 1"),
        (lambda: light.picture(eye=[0, 0, 0]), "eye and target: one", "both"),
        (lambda: light.save("a.jpeg"), "a.jpeg", "end it in"),
        (lambda: radiosity.heat(factors, temperature=[1, 2]), "temperature: shape (2,)", "6 rows"),
        (lambda: radiosity.heat(factors, temperature=-1), "temperature[0]: -1", "at least 0 K"),
        (
            lambda: radiosity.heat(factors, temperature=1, emissivity=1.5),
            "emissivity[0, 0]: 1.5",
            "at most 1",
        ),
        (
            lambda: radiosity.heat(factors, temperature=1, emissivity=[1, 1]),
            "emissivity: shape (2,)",
            "(6,)",
        ),
        (
            lambda: radiosity.heat(factors, temperature=1, band_edges=[5, 3], emissivity=1),
            "band edges",
            "ascend",
        ),
        (lambda: radiosity.heat(np.ones((2, 3)), temperature=1, areas=1), "shape (2, 3)", "square"),
        (lambda: (factors * 2).checks(), "a result of arithmetic", "radiosity.view_factors"),
    ]
    for call, found, remedy in cases:
        with pytest.raises(ValueError) as error:
            call()
        message = str(error.value)
        assert found in message and remedy in message, message


def test_a_wrong_path_is_an_error_of_the_system(light, tmp_path):
    with pytest.raises(OSError, match="cannot be written"):
        light.save(tmp_path / "none" / "a.ply")
