"""Arguments that all long work has."""

from __future__ import annotations

from typing import Callable, NamedTuple, Optional

from ._check import wrong


class Progress(NamedTuple):
    """How far long work is."""

    #: What is being done.
    stage: str
    #: Share of the stage that is done, in [0, 1]; ``None`` where it is not known.
    done: Optional[float]
    #: Estimate of the error so far, as a share; ``None`` before the first.
    error: Optional[float]
    #: Seconds since the start.
    seconds: float


Callback = Callable[[Progress], object]


def callback(progress: Optional[Callback]):
    """The function that the extension calls."""
    if progress is None:
        return None
    if not callable(progress):
        raise wrong("progress", f"a {type(progress).__name__}", "give a function of a Progress")
    return lambda *state: progress(Progress(*state))


def thread_count(threads: Optional[int]) -> int:
    """Number of threads, 0 for one a core."""
    if threads is None:
        return 0
    if isinstance(threads, bool) or not isinstance(threads, int) or not 1 <= threads <= 1024:
        raise wrong("threads", repr(threads), "give a whole number from 1 to 1024, or None")
    return threads
