"""Bakes, and what is measured in them, against closed forms."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from conftest import CUBE, SIDES

import radiosity

#: Radiosity of a furnace: a closed room of reflectance r whose faces all emit E has E / (1 - r).
REFLECTANCE, EXITANCE = 0.5, 2.0


@pytest.fixture
def furnace():
    return radiosity.Scene(CUBE, SIDES, reflectance=REFLECTANCE, exitance=EXITANCE)


def test_a_furnace_has_its_radiosity_everywhere(furnace):
    light = radiosity.bake(furnace, error=0.02, device="cpu")
    expected = EXITANCE / (1 - REFLECTANCE)
    # The error asked for is of the reflected half, in the mean over the area.
    assert light.radiosity == pytest.approx(expected, rel=0.02)
    assert light.report["reached"] and light.report["error"] <= 0.02
    assert light.irradiance == pytest.approx(expected, rel=0.04)
    assert light.error.shape == (len(light.vertices),) and light.faces.max() < len(light.vertices)
    assert light.face_groups.shape == (len(light.faces),)
    found = radiosity.verify(furnace, light, time=20)
    assert found.error < 0.02 and found.missing == 0


def test_arrays_keep_their_bake_and_are_read_only(room):
    radiosity_of_it = radiosity.bake(room, error=0.2, device="cpu").radiosity
    assert np.isfinite(radiosity_of_it).all()
    with pytest.raises(ValueError):
        radiosity_of_it[0] = 0.0


def test_light_at_the_vertices_that_were_given(room):
    light = radiosity.bake(room, error=0.1, device="cpu", keep_vertices=True)
    assert np.array_equal(light.vertices, CUBE) and light.radiosity.shape == (8, 3)


def test_verify_finds_a_wrong_solution(room):
    light = radiosity.bake(room, error=0.05, device="cpu")
    wrong = (light.vertices, light.faces, 1.2 * light.radiosity)
    found = radiosity.verify(room, wrong, time=20)
    # A fifth more than it should be, emitted light included: at least a fifth of the reflected.
    assert found.error > 0.19
    assert set(found.groups) == set("abcdef") or len(found.groups) == 6


def test_time_ends_a_bake(room):
    light = radiosity.bake(room, time=1.0, device="cpu")
    assert light.report["error"] < 0.1


def test_progress_hears_of_it_and_stops_it(room):
    heard = []
    radiosity.bake(room, error=0.01, device="cpu", progress=heard.append)
    assert heard and all(isinstance(p, radiosity.Progress) for p in heard)
    assert [p.seconds for p in heard] == sorted(p.seconds for p in heard)
    stopped = radiosity.bake(room, error=0.001, device="cpu", progress=lambda p: False)
    assert stopped.report["stopped"] and len(stopped.vertices) > 0

    def fail(_):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        radiosity.bake(room, error=0.001, device="cpu", progress=fail)


def test_a_grid_in_a_furnace(furnace):
    light = radiosity.bake(furnace, error=0.05, device="cpu")
    expected = EXITANCE / (1 - REFLECTANCE)
    (grid,) = radiosity.grid(light, 0.02, plane=[[0.1, 0.1, 0.5], [0.8, 0, 0], [0, 0.8, 0]])
    assert grid.points.shape == grid.irradiance.shape and grid.reached
    assert grid.irradiance == pytest.approx(expected, rel=0.03)
    assert grid.uniformity > 0.95
    with pytest.raises(ValueError, match="none is large enough"):
        radiosity.grid(light)


def test_probes_in_a_furnace(furnace):
    light = radiosity.bake(furnace, error=0.05, device="cpu")
    probes = radiosity.probes(light, 0.02, counts=(2, 3, 1))
    assert probes.harmonics.shape == (6, 9, 3) and probes.counts == (2, 3, 1)
    assert not probes.inside.any()
    for normal in ([0, 0, 1], [1, 2, -3]):
        assert probes.irradiance(normal) == pytest.approx(4.0, rel=0.03)


def test_a_light_map_of_a_furnace(furnace, tmp_path):
    made = radiosity.light_map(furnace, 0.05, size=64, device="cpu")
    assert made.irradiance.shape[2] == 3 and made.gathered.any()
    assert made.irradiance[made.gathered] == pytest.approx(4.0, rel=0.06)
    assert made.coordinates.min() >= 0 and made.coordinates.max() <= 1
    assert len(made.coordinates) == len(made.scene.faces)
    for name in ("m.exr", "m.ktx2", "m.png", "m.glb"):
        made.save(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 100
    with pytest.raises(ValueError, match="end it in"):
        made.save(tmp_path / "m.bmp")


def test_files_and_pictures(room, tmp_path):
    light = radiosity.bake(room, error=0.2, device="cpu")
    for name in ("a.ply", "a.glb", "a.png", "a.exr"):
        light.save(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 1000
    picture = light.picture((60, 40), eye=[0.5, 0.1, 0.5], target=[0.5, 1, 0.5])
    assert picture.shape == (40, 60, 3) and picture.dtype == np.uint8 and picture.max() > 100
    with pytest.raises(OSError):
        light.save(tmp_path / "none" / "a.ply")


def test_the_file_is_that_of_the_program():
    """The same bytes as on every platform: `tests/same_bytes.rs` has the table."""
    root = Path(__file__).parents[2]
    table = root / "tests/data/same_bytes.json"
    if not table.exists():
        pytest.skip("not in the source tree")
    import tempfile

    for bake in json.loads(table.read_text())[:1]:
        light = radiosity.bake(root / bake["scene"], bake["error"], device="cpu", threads=1)
        with tempfile.TemporaryDirectory() as folder:
            light.save(f"{folder}/a.ply")
            content = Path(folder, "a.ply").read_bytes()
        assert hashlib.sha256(content).hexdigest() == bake["sha256"]
