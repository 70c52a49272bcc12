"""What an error costs: the Cornell box to errors from 20 to 1 %, verified by paths.

    python trade_off.py [SCENE [PICTURE.png]]
"""

import sys
from pathlib import Path

import matplotlib

if len(sys.argv) > 2:
    matplotlib.use("agg")
import matplotlib.pyplot as plt

import radiosity

scenes = Path(__file__).resolve().parents[2] / "scenes"
scene = radiosity.Scene.load(sys.argv[1] if len(sys.argv) > 1 else scenes / "cornell_box.obj")
lines = []
for asked in (0.2, 0.1, 0.05, 0.02, 0.01):
    light = radiosity.bake(scene, error=asked)
    found = radiosity.verify(scene, light, time=30)
    lines.append((light.report["seconds"], asked, light.report["error"], found.error))
    seconds, _, estimated, measured = lines[-1]
    print(f"{100 * asked:4.1f} % asked: {seconds:6.2f} s, {100 * estimated:5.2f} % estimated, "
          f"{100 * measured:5.2f} % measured, {len(light.vertices)} vertices")

seconds, *errors = zip(*lines)
for name, style, values in zip(("asked", "estimated", "measured"), (":", "--", "o-"), errors):
    plt.loglog(seconds, [100 * value for value in values], style, label=name)
plt.gca().xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
plt.gca().set(xlabel="seconds", ylabel="error, %", title=f"{len(scene.faces)} triangles")
plt.grid(which="both", alpha=0.3)
plt.legend()
plt.savefig(sys.argv[2], dpi=120) if len(sys.argv) > 2 else plt.show()
