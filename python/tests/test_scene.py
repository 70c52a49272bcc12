"""Scenes of arrays and files."""

import numpy as np
import pytest
from conftest import CUBE, SIDES

import radiosity


@pytest.mark.parametrize("dtype", [np.float64, np.float32, np.float16, np.int64, np.uint8])
@pytest.mark.parametrize("order", ["C", "F", "strided", "reversed", "read-only"])
def test_any_type_and_layout_of_arrays(dtype, order):
    vertices = np.asarray(CUBE, dtype=dtype)
    faces = SIDES.astype(np.int16)
    if order == "F":
        vertices, faces = np.asfortranarray(vertices), np.asfortranarray(faces)
    elif order == "strided":
        vertices = np.repeat(vertices, 2, axis=0)[::2]
        faces = np.repeat(faces, 2, axis=1)[:, ::2]
    elif order == "reversed":
        vertices, faces = vertices[::-1][::-1], faces[::-1][::-1]
    elif order == "read-only":
        vertices.flags.writeable = faces.flags.writeable = False
    scene = radiosity.Scene(vertices, faces)
    assert np.array_equal(scene.vertices, CUBE)
    assert scene.faces.shape == (12, 3) and not scene.vertices.flags.writeable


def test_a_concave_quadrilateral_is_cut_inside():
    # An arrow: the diagonal from its tip to its notch lies inside, the other does not.
    arrow = np.array([[0.0, 0, 0], [2, 1, 0], [0, 2, 0], [1, 1, 0]])
    scene = radiosity.Scene(arrow, [[0, 1, 2, 3]])
    p = scene.vertices[scene.faces]
    areas = 0.5 * np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])[:, 2]
    # By the shoelace formula.
    assert (areas > 0).all() and areas.sum() == pytest.approx(1.0, abs=1e-15)


def test_properties_by_face_are_materials():
    reflectance = np.linspace(0.1, 0.6, 6)
    scene = radiosity.Scene(CUBE, SIDES, reflectance=reflectance, exitance=[1, 2, 3])
    assert len(scene.materials) == 6
    same = radiosity.Scene(CUBE, SIDES, reflectance=[0.1, 0.1, 0.1], exitance=0)
    assert len(same.materials) == 1


def test_groups_have_names_in_the_order_of_faces():
    scene = radiosity.Scene(CUBE, SIDES, groups=["floor", "ceiling", "wall", "wall", "wall", 7])
    assert scene.groups == ["floor", "ceiling", "wall", "7"]
    assert scene.face_groups.tolist() == [0, 0, 1, 1, 2, 2, 2, 2, 2, 2, 3, 3]


def test_a_file_of_bytes_is_that_of_a_path(tmp_path):
    obj = b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl lamp\nf 1 2 3\n"
    mtl = b"newmtl lamp\nKd 0.2 0.2 0.2\nKe 1 1 1\n"
    (tmp_path / "a.obj").write_bytes(obj)
    (tmp_path / "m.mtl").write_bytes(mtl)
    by_path = radiosity.Scene.load(tmp_path / "a.obj")
    by_bytes = radiosity.Scene.load(obj, name="a.obj", files={"m.mtl": mtl})
    for scene in (by_path, by_bytes):
        assert scene.materials == ["lamp"] and scene.warnings == []
    assert np.array_equal(by_path.vertices, by_bytes.vertices)
    with pytest.raises(OSError, match="cannot be read"):
        radiosity.Scene.load(tmp_path / "none.obj")
    with pytest.raises(ValueError, match="no material 'x'"):
        radiosity.Scene.load(tmp_path / "a.obj", emit={"x": 1.0})


def test_meshes_of_trimesh_and_pyvista_are_scenes():
    trimesh = pytest.importorskip("trimesh")
    assert radiosity.bake(trimesh.creation.box(), 0.5, device="cpu").vertices.shape[1] == 3
    pyvista = pytest.importorskip("pyvista")
    cube = pyvista.Cube()
    factors = radiosity.view_factors(cube)
    # Six quadrilaterals that see nothing of each other from outside.
    assert factors.shape == (6, 6) and factors.nnz == 0


def test_the_sun_is_where_it_is():
    import datetime

    # Greenwich nine hours after the equinox of 2024: 90 - 51.48 degrees, 0.15 more by the
    # declination since, 0.03 less as it is 7.5 minutes before true noon.
    noon = datetime.datetime(2024, 3, 20, 12, tzinfo=datetime.timezone.utc)
    sun = radiosity.sun_direction(noon, 51.48, 0.0)
    assert np.linalg.norm(sun) == pytest.approx(1.0, abs=1e-15)
    assert 38.6 < np.degrees(np.arcsin(sun[2])) < 38.68 and sun[1] < -0.7 and abs(sun[0]) < 0.05
    # The same by another zone and other axes.
    zone = datetime.timezone(datetime.timedelta(hours=5))
    turned = radiosity.sun_direction(
        noon.astimezone(zone), 51.48, 0.0, up=(0, 1, 0), north=(0, 0, -1)
    )
    assert turned == pytest.approx([sun[0], sun[2], -sun[1]], abs=1e-15)


def test_skies_give_their_irradiance():
    assert radiosity.Sky.uniform(2.0).irradiance([0, 0, 1]) == pytest.approx(2 * np.pi)
    # The overcast sky: 7/9 of a uniform one of its zenith (P. Moon and D. E. Spencer 1942), by
    # pieces of 0.3 degrees.
    overcast = radiosity.Sky.cie(16, 1.0).irradiance([0, 0, 1])
    assert overcast == pytest.approx(7 * np.pi / 9, rel=1e-3)
    sun = [0.3, 0.2, 0.9]
    assert radiosity.Sky.perez(600, 120, sun).irradiance([0, 0, 1]) == pytest.approx(120, rel=1e-3)
    pixels = np.ones((2, 4, 3), np.float32)
    assert radiosity.Sky.picture(pixels).irradiance([0, 1, 0]) == pytest.approx(np.pi, rel=1e-3)
