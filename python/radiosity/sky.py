"""The light from outside: skies, and where the sun is."""

from __future__ import annotations

import datetime
import math
import os
from typing import Optional, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _check
from ._radiosity import Sky as _Sky
from ._radiosity import sun_angles

__all__ = ["Sky", "sun_direction"]


def sun_direction(
    when: datetime.datetime,
    latitude: float,
    longitude: float,
    *,
    up: ArrayLike = (0.0, 0.0, 1.0),
    north: ArrayLike = (0.0, 1.0, 0.0),
) -> np.ndarray:
    """Unit vector towards the sun.

    Parameters
    ----------
    when : datetime.datetime
        The time; with a time zone (``tzinfo``), since local time says little.
    latitude, longitude : float
        The place, degrees north and east.
    up, north : array_like, (3,)
        Axes of the scene.

    Returns
    -------
    numpy.ndarray, (3,)
        Within 0.0003° without refraction (I. Reda and A. Andreas 2003, "Solar
        position algorithm for solar radiation applications"). Below the
        horizon at night.
    """
    if not isinstance(when, datetime.datetime):
        raise _check.wrong("when", f"a {type(when).__name__}", "give a datetime.datetime")
    if when.tzinfo is None:
        remedy = "add one: tzinfo=datetime.timezone.utc or zoneinfo.ZoneInfo('Europe/Berlin')"
        raise _check.wrong("when", "a time without a time zone", remedy)
    latitude = _check.number("latitude", latitude, least=-90.0, most=90.0)
    longitude = _check.number("longitude", longitude, least=-180.0, most=180.0)
    upwards = np.array(_check.direction("up", up))
    upwards /= np.linalg.norm(upwards)
    level = np.array(_check.direction("north", north))
    level -= level.dot(upwards) * upwards
    if np.linalg.norm(level) < 1e-9:
        raise _check.wrong("north", "it is along up", "give another")
    level /= np.linalg.norm(level)
    utc = when.astimezone(datetime.timezone.utc)
    seconds = utc.second + 1e-6 * utc.microsecond
    date = (utc.year, utc.month, utc.day)
    azimuth, elevation = sun_angles(date, (utc.hour, utc.minute, seconds), latitude, longitude)
    azimuth, elevation = math.radians(azimuth), math.radians(elevation)
    east = np.cross(level, upwards)
    around = math.cos(azimuth) * level + math.sin(azimuth) * east
    return math.cos(elevation) * around + math.sin(elevation) * upwards


class Sky:
    """The light from outside of a scene. Made by one of its class methods."""

    _native: _Sky

    def __init__(self) -> None:
        raise _check.wrong("Sky()", "no kind", "call Sky.uniform, Sky.cie, Sky.perez, …")

    @classmethod
    def _of(cls, native: _Sky) -> Sky:
        sky = object.__new__(cls)
        sky._native = native
        return sky

    @classmethod
    def uniform(cls, radiance: ArrayLike) -> Sky:
        """The same radiance from everywhere, also from below.

        Parameters
        ----------
        radiance : float or array_like, (3,)
            W/(m² sr): an open surface receives π times that, W/m².
        """
        return cls._of(_Sky.uniform(_check.colour("radiance", radiance)))

    @classmethod
    def cie(
        cls,
        number: int = 16,
        zenith: ArrayLike = 1.0,
        *,
        up: ArrayLike = (0.0, 0.0, 1.0),
        sun: Optional[ArrayLike] = None,
    ) -> Sky:
        """A sky of CIE S 011/E:2003; black below the horizon.

        Parameters
        ----------
        number : int
            1 to 15, or 16 for the traditional overcast sky (the default).
        zenith : float or array_like, (3,)
            Radiance straight up, W/(m² sr).
        up : array_like, (3,)
            The scene's upward axis.
        sun : array_like, (3,), optional
            Direction towards the sun, which is not itself in this sky: see `with_sun`.
        """
        if isinstance(number, bool) or not isinstance(number, int) or not 1 <= number <= 16:
            raise _check.wrong("number", repr(number), "give a whole number from 1 to 16")
        upwards = _check.direction("up", up)
        towards = upwards if sun is None else _check.direction("sun", sun)
        return cls._of(_Sky.cie(number, _check.colour("zenith", zenith), upwards, towards))

    @classmethod
    def perez(
        cls,
        direct_normal: float,
        diffuse_horizontal: float,
        sun: ArrayLike,
        *,
        up: ArrayLike = (0.0, 0.0, 1.0),
        dew_point: Optional[float] = None,
        day: int = 0,
    ) -> Sky:
        """Sky and sun by two measured numbers (R. Perez, R. Seals and J. Michalsky 1993).

        Parameters
        ----------
        direct_normal : float
            Irradiance of a surface that faces the sun, from the sun alone, W/m².
        diffuse_horizontal : float
            Irradiance of level ground from the sky alone, W/m².
        sun : array_like, (3,)
            Direction towards the sun: `sun_direction`.
        up : array_like, (3,)
            The scene's upward axis.
        dew_point : float, optional
            Degrees Celsius; with it the light is in lumens: illuminance in lux.
        day : int
            Day of the year, 1 to 366, for the distance of the sun; 0 for the mean.
        """
        direct = _check.number("direct_normal", direct_normal, least=0.0)
        diffuse = _check.number("diffuse_horizontal", diffuse_horizontal, least=0.0)
        if dew_point is not None:
            dew_point = _check.number("dew_point", dew_point, least=-90.0, most=60.0)
        if isinstance(day, bool) or not isinstance(day, int) or not 0 <= day <= 366:
            raise _check.wrong("day", repr(day), "give a whole number from 0 to 366")
        upwards, towards = _check.direction("up", up), _check.direction("sun", sun)
        return cls._of(_Sky.perez(direct, diffuse, upwards, towards, dew_point, day))

    @classmethod
    def picture(
        cls,
        pixels: Union[ArrayLike, str, os.PathLike],
        *,
        up: ArrayLike = (0.0, 1.0, 0.0),
    ) -> Sky:
        """A picture around the scene.

        Parameters
        ----------
        pixels : array_like, (rows, columns, 3), or path
            Radiance, W/(m² sr), from straight up to straight down, each row
            once around; or an OpenEXR or Radiance file.
        up : array_like, (3,)
            The scene's upward axis.
        """
        upwards = _check.direction("up", up)
        if isinstance(pixels, (str, os.PathLike)):
            return cls._of(_Sky.load(os.fspath(pixels), upwards))
        remedy = "give radiance of shape (rows, columns, 3), or a path"
        given = _check.array("pixels", pixels, remedy)
        if given.ndim != 3 or given.shape[2] != 3 or given.size == 0:
            raise _check.wrong("pixels", f"shape {given.shape}", remedy)
        flat = given.reshape(-1, 3).astype(np.float64, copy=False)
        return cls._of(_Sky.picture(flat, given.shape[1], upwards))

    def with_sun(self, direction: ArrayLike, irradiance: ArrayLike) -> Sky:
        """The same sky with a sun, a disc of half a degree.

        Parameters
        ----------
        direction : array_like, (3,)
            Towards it.
        irradiance : float or array_like, (3,)
            Of a surface that faces it, W/m².
        """
        towards = _check.direction("direction", direction)
        return Sky._of(self._native.with_sun(towards, _check.colour("irradiance", irradiance)))

    def irradiance(self, normal: ArrayLike) -> np.ndarray:
        """Irradiance of an open surface with this normal, without the sun, W/m², (3,)."""
        return np.array(self._native.irradiance(_check.direction("normal", normal)))
