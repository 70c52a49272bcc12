"""Ctrl-C, threads, forks, memory."""

import gc
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest
from conftest import CUBE, SIDES

import radiosity

#: A room that no machine bakes to this error in a minute.
LONG = """
    import numpy as np, radiosity, signal, time
    # A shell ignores it for what runs in the background, and Python takes that over.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    rng = np.random.default_rng(1)
    corners = rng.uniform(0, 1, (3000, 1, 3)) + 0.03 * rng.normal(size=(3000, 3, 3))
    scene = radiosity.Scene(
        corners.reshape(-1, 3), np.arange(9000).reshape(-1, 3), sky=radiosity.Sky.uniform(1)
    )
    print("begun", flush=True)
    start = time.time()
"""


def interrupted(code: str, after: float) -> "tuple[float, str, int]":
    """Seconds from Ctrl-C to the end of a program, its output and exit status."""
    program = textwrap.dedent(LONG) + textwrap.dedent(code)
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "begun\n"
    time.sleep(after)
    sent = time.time()
    process.send_signal(signal.SIGINT)
    try:
        out, _ = process.communicate(timeout=60)
    finally:
        process.kill()
    return time.time() - sent, out, process.returncode


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("after", [0.3, 3.0])
def test_ctrl_c_ends_a_bake_with_what_there_is(after):
    code = """
        light = radiosity.bake(scene, error=0.0005, device="cpu")
        print(light.report["stopped"], len(light.vertices), np.isfinite(light.radiosity).all())
    """
    seconds, out, status = interrupted(code, after)
    stopped, vertices, finite = out.split()
    assert stopped == "True" and int(vertices) >= 9000 and finite == "True" and status == 0
    # No test of speed: where it were not heard at all, this would take minutes.
    assert seconds < 30


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_ends_view_factors():
    code = """
        try:
            radiosity.view_factors(scene, error=1e-6)
        except KeyboardInterrupt:
            print("interrupted")
    """
    _, out, status = interrupted(code, 1.0)
    assert out == "interrupted\n" and status == 0


def test_the_lock_is_free_during_a_bake(room):
    counted = []

    def count():
        while not done.is_set():
            counted.append(1)
            time.sleep(0.001)

    done = threading.Event()
    counter = threading.Thread(target=count)
    counter.start()
    radiosity.bake(room, error=0.01, device="cpu", threads=1)
    done.set()
    counter.join()
    assert len(counted) > 10


def test_two_threads_bake_at_once_and_alike(room):
    alone = radiosity.bake(room, error=0.05, device="cpu")
    results = [None, None]

    def bake(k):
        results[k] = radiosity.bake(room, error=0.05, device="cpu", threads=1 + k)

    threads = [threading.Thread(target=bake, args=(k,)) for k in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for light in results:
        assert np.array_equal(light.radiosity, alone.radiosity)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_bake_works_after_a_fork(room, tmp_path):
    radiosity.bake(room, error=0.3, device="cpu").save(tmp_path / "parent.png")
    child = os.fork()
    if child == 0:
        light = radiosity.bake(room, error=0.3, device="cpu")
        light.save(tmp_path / "child.png")
        os._exit(0 if np.isfinite(light.radiosity).all() else 1)
    deadline = time.time() + 60
    while time.time() < deadline:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            assert status == 0
            return
        time.sleep(0.05)
    os.kill(child, signal.SIGKILL)
    pytest.fail("the child hangs")


def resident() -> int:
    """Bytes of memory of this process."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="no /proc")
def test_a_thousand_bakes_leak_nothing():
    square = radiosity.Scene(CUBE[:4], SIDES[:1], sky=radiosity.Sky.uniform(1.0))

    def bake_some(count):
        for _ in range(count):
            light = radiosity.bake(square, error=0.5, device="cpu", threads=1)
            assert len(light.radiosity) == len(light.vertices)
        gc.collect()
        return resident()

    before = bake_some(200)
    after = bake_some(800)
    # A kilobyte lost in each would be 0.8 MB; what allocators keep varies by some pages.
    assert after - before < 3 << 20, f"{(after - before) / 800:.0f} bytes a bake"
