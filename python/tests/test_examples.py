"""The examples run, and are short."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"

#: Each with arguments, what it prints, and what it imports beside NumPy and SciPy.
CASES = {
    "room.py": (["{out}.png"], "Bake", ["pyvista"]),
    "view_factors.py": (["1"], "off from cubature", ["pyvista", "trimesh", "pyviewfactor"]),
    "furnace.py": ([], "out of balance", ["trimesh"]),
    "daylight.py": (["{out}.png"], "uniformity", ["matplotlib"]),
    "light_map.py": (["{out}.glb"], "texels", ["trimesh"]),
    "trade_off.py": (["{scene}", "{out}.png"], "measured", ["matplotlib"]),
}


def test_each_example_is_here():
    assert {path.name for path in EXAMPLES.glob("*.py")} == set(CASES)


@pytest.mark.parametrize("name", CASES)
def test_an_example_runs(name, tmp_path):
    arguments, printed, needed = CASES[name]
    for module in needed:
        pytest.importorskip(module)
    scene = EXAMPLES.parents[1] / "scenes/cornell_box.obj"
    if "{scene}" in arguments and not scene.exists():
        pytest.skip("not in the source tree")
    out = tmp_path / "out"
    arguments = [a.format(out=out, scene=scene) for a in arguments]
    environment = {**os.environ, "PYVISTA_OFF_SCREEN": "true", "MPLBACKEND": "agg"}
    run = subprocess.run(
        [sys.executable, str(EXAMPLES / name), *arguments],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert run.returncode == 0, run.stderr
    assert printed in run.stdout
    for argument in arguments:
        if argument.startswith(str(out)):
            assert Path(argument).stat().st_size > 1000
    lines = (EXAMPLES / name).read_text().splitlines()
    assert len(lines) < 60, f"{len(lines)} lines"
