"""Checks of what is given: each error says where, what was found and what would be right."""

from __future__ import annotations

import math
import os
from typing import Any, Optional, Sequence

import numpy as np


def wrong(place: str, found: str, remedy: str) -> ValueError:
    """The error for something at a place."""
    return ValueError(f"{place}: {found}; {remedy}")


def array(name: str, value: Any, remedy: str) -> np.ndarray:
    """`value` as an array of numbers, copied only if it is not one."""
    if isinstance(value, (str, bytes, os.PathLike)) or value is None:
        raise wrong(name, f"a {type(value).__name__}", remedy)
    try:
        given = np.asarray(value)
    except ValueError:
        raise wrong(name, "rows of different lengths", remedy) from None
    if given.dtype == object:
        raise wrong(name, "objects that are not numbers", remedy)
    if given.dtype.kind not in "iuf":
        raise wrong(name, f"numbers of type {given.dtype}", remedy)
    return given


def finite(name: str, numbers: np.ndarray) -> np.ndarray:
    """Refuses what is not finite, with its index."""
    if numbers.size and not math.isfinite(float(np.sum(numbers))):
        bad = np.argwhere(~np.isfinite(numbers))
        if len(bad):
            at = ", ".join(map(str, bad[0]))
            raise wrong(f"{name}[{at}]", str(numbers[tuple(bad[0])]), "give finite numbers")
    return numbers


def vectors(name: str, value: Any, columns: int = 3) -> np.ndarray:
    """Rows of finite numbers, (n, columns) of float64."""
    remedy = f"give an array of shape (n, {columns})"
    given = array(name, value, remedy)
    if given.ndim != 2 or given.shape[1] != columns:
        raise wrong(name, f"shape {given.shape}", remedy)
    if len(given) == 0:
        raise wrong(name, "no rows", "give at least one")
    return finite(name, given.astype(np.float64, copy=False))


def faces(value: Any, count: int) -> np.ndarray:
    """Triangles or quadrilaterals, (m, 3) or (m, 4) of uint32, whose corners are of `count`
    vertices."""
    remedy = "give indices of vertices, from 0, of shape (m, 3) or (m, 4)"
    given = array("faces", value, remedy)
    if given.ndim != 2 or given.shape[1] not in (3, 4):
        if given.ndim == 1 and given.size:
            remedy += "; a pyvista mesh can be given itself"
        raise wrong("faces", f"shape {given.shape}", remedy)
    if len(given) == 0:
        raise wrong("faces", "no rows", "give at least one")
    if given.dtype.kind == "f":
        raise wrong("faces", f"numbers of type {given.dtype}", "give integers: faces.astype(int)")
    low, high = int(given.min()), int(given.max())
    if low < 0 or high >= count:
        row, column = np.argwhere((given < 0) | (given >= count))[0]
        found = f"vertex {given[row, column]} of {count}"
        raise wrong(f"faces[{row}, {column}]", found, f"count vertices from 0 to {count - 1}")
    return given.astype(np.uint32, copy=False)


def colours(name: str, value: Any, count: int, *, below: float = math.inf) -> np.ndarray:
    """Colours of `count` faces, (count, 3): of a number, three, one a face or three a face."""
    remedy = f"give a number, three (red, green, blue), or an array of shape ({count},) or ({count}, 3)"
    given = finite(name, array(name, value, remedy)).astype(np.float64, copy=False)
    if given.ndim == 1 and given.shape[0] == count and count != 3:
        given = given[:, np.newaxis]
    try:
        all_faces = np.broadcast_to(given, (count, 3))
    except ValueError:
        raise wrong(name, f"shape {given.shape}", remedy) from None
    if given.ndim == 2 and given.shape[0] not in (1, count):
        raise wrong(name, f"shape {given.shape}", remedy)
    bad = (all_faces < 0) | (all_faces >= below)
    if bad.any():
        row, column = np.argwhere(bad)[0]
        place = name if given.ndim < 2 else f"{name} of face {row}"
        limits = "at least 0" if math.isinf(below) else f"at least 0 and below {below:g}"
        raise wrong(place, str(all_faces[row, column]), f"give {limits}")
    return all_faces


def vector(name: str, value: Any, count: int = 3) -> list[float]:
    """A few finite numbers."""
    remedy = f"give {count} numbers"
    given = array(name, value, remedy)
    if given.shape != (count,):
        raise wrong(name, f"shape {given.shape}", remedy)
    return [float(x) for x in finite(name, given)]


def direction(name: str, value: Any) -> list[float]:
    """Three numbers that are not all 0."""
    given = vector(name, value)
    if not any(given):
        raise wrong(name, "0, 0, 0", "give a direction")
    return given


def colour(name: str, value: Any) -> list[float]:
    """One or three numbers, at least 0."""
    given = finite(name, array(name, value, "give a number, or red, green and blue"))
    if given.shape not in ((), (1,), (3,)):
        raise wrong(name, f"shape {given.shape}", "give a number, or red, green and blue")
    if (given < 0).any():
        raise wrong(name, str(given.min()), "give at least 0")
    return [float(x) for x in np.broadcast_to(given, 3)]


def number(
    name: str,
    value: Any,
    *,
    above: float = -math.inf,
    least: float = -math.inf,
    below: float = math.inf,
    most: float = math.inf,
) -> float:
    """A finite number within limits."""
    limits = []
    if above > -math.inf:
        limits.append(f"above {above:g}")
    if least > -math.inf:
        limits.append(f"at least {least:g}")
    if below < math.inf:
        limits.append(f"below {below:g}")
    if most < math.inf:
        limits.append(f"at most {most:g}")
    remedy = " ".join(["give a number", " and ".join(limits)]).strip()
    if isinstance(value, (bool, str, bytes)) or value is None:
        raise wrong(name, repr(value), remedy)
    try:
        given = float(value)
    except (TypeError, ValueError):
        raise wrong(name, f"a {type(value).__name__}", remedy) from None
    if not (math.isfinite(given) and above < given < below and least <= given <= most):
        raise wrong(name, repr(value), remedy)
    return given


def choice(name: str, value: Any, of: Sequence[str]) -> str:
    """One of some words."""
    if value not in of:
        raise wrong(name, repr(value), "give " + " or ".join(map(repr, of)))
    return value


def share(name: str, value: Optional[float]) -> float:
    """An error, as a share."""
    given = number(name, value, above=0.0, below=1.0)
    return given
