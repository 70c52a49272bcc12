"""The compiled part. Its arguments are checked by the functions that call it."""

from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Vector = List[float]
Report = Optional[Callable[[str, Optional[float], Optional[float], float], object]]

class Stopped(RuntimeError):
    """The progress function stopped work that leaves nothing until it is done."""

class Scene:
    @staticmethod
    def from_arrays(
        positions: Floats,
        faces: NDArray[np.uint32],
        groups: NDArray[np.uint32],
        materials: NDArray[np.uint32],
        group_names: List[str],
        material_names: List[str],
        properties: Floats,
        both_sides: Optional[bool],
        up: Optional[Vector],
    ) -> Scene: ...
    @staticmethod
    def load(
        path: str,
        content: Optional[Tuple[bytes, List[Tuple[str, bytes]]]],
        emit: List[Tuple[str, Vector]],
        transmit: List[Tuple[str, Vector]],
        facets: bool,
        strict: bool,
        texture_coordinates: bool,
        ignore_glass: bool,
        has_sky: bool,
    ) -> Scene: ...
    def with_sky(self, sky: Sky) -> Scene: ...
    def with_luminaires(
        self, luminaires: List[Tuple[str, Vector, Vector, float]], unit: float
    ) -> Scene: ...
    positions: Floats
    faces: NDArray[np.uint32]
    face_groups: NDArray[np.uint32]
    groups: List[str]
    materials: List[str]
    warnings: List[str]
    bounds: List[Vector]
    up: Vector

class Sky:
    @staticmethod
    def uniform(radiance: Vector) -> Sky: ...
    @staticmethod
    def cie(number: int, zenith: Vector, up: Vector, sun: Vector) -> Sky: ...
    @staticmethod
    def perez(
        direct_normal: float,
        diffuse_horizontal: float,
        up: Vector,
        sun: Vector,
        dew_point: Optional[float],
        day: int,
    ) -> Sky: ...
    @staticmethod
    def picture(pixels: Floats, width: int, up: Vector) -> Sky: ...
    @staticmethod
    def load(path: str, up: Vector) -> Sky: ...
    def with_sun(self, direction: Vector, irradiance: Vector) -> Sky: ...
    def irradiance(self, normal: Vector) -> Vector: ...

class Image:
    pixels: Floats
    def colours(self) -> NDArray[np.uint8]: ...

class Grid:
    name: str
    points: Floats
    irradiance: Floats
    standard_error: Floats
    mean_error: Vector
    is_reached: bool

class Bake:
    positions: Floats
    normals: Floats
    faces: NDArray[np.uint32]
    radiosity: Floats
    irradiance: Floats
    error: Floats
    face_groups: NDArray[np.uint32]
    scene: Scene
    def report(self) -> Dict[str, Any]: ...
    def save(self, path: str, source: Optional[str] = None) -> None: ...
    def picture(
        self,
        camera: Optional[Tuple[Vector, Vector, Vector, float]],
        size: List[int],
        threads: int,
    ) -> Image: ...
    def grid(
        self,
        error: float,
        plane: Optional[List[Vector]],
        group: Optional[str],
        height: float,
        strip: float,
        spacing: Optional[float],
        metre: float,
        threads: int,
        progress: Report,
    ) -> List[Grid]: ...
    def probes(
        self, error: float, positions: Floats, size: float, threads: int, progress: Report
    ) -> Tuple[Floats, Floats, NDArray[np.bool_], bool]: ...

class Atlas:
    scene: Scene

class LightMap:
    irradiance: Floats
    gathered: NDArray[np.bool_]
    standard_error: Floats
    coordinates: Floats
    scene: Scene
    error_between_texels: Optional[Tuple[float, float]]
    error_of_light: float
    def save(
        self, path: str, source: Optional[str], binding: str, map_file: Optional[str]
    ) -> None: ...

class Factors:
    names: List[str]
    back_of: NDArray[np.int64]
    areas: Floats
    open: Floats
    back: Floats
    is_exact: bool
    def rows(self) -> Tuple[Floats, Floats, NDArray[np.int32], NDArray[np.int64]]: ...
    def checks(self) -> Dict[str, Tuple[float, float]]: ...
    def enforced(self) -> Tuple[Factors, float]: ...
    def save(self, path: str) -> None: ...

def sun_angles(
    date: Tuple[int, int, int], time: Tuple[int, int, float], latitude: float, longitude: float
) -> Vector: ...
def bake(
    scene: Scene,
    error: Optional[float],
    time: Optional[float],
    each_group: bool,
    keep_vertices: bool,
    device_name: str,
    threads: int,
    progress: Report,
) -> Tuple[Bake, Optional[BaseException]]: ...
def probe_positions(
    bounds: List[Vector], counts: Optional[List[int]], spacing: float
) -> Tuple[Floats, List[int], float]: ...
def verify_solution(
    scene: Scene,
    positions: Floats,
    faces: NDArray[np.uint32],
    radiosity: Floats,
    precision: float,
    time: Optional[float],
    seed: int,
    threads: int,
    progress: Report,
) -> Dict[str, Any]: ...
def atlas(
    scene: Scene, pixels: Optional[int], texel: Optional[float], coordinates: str, padding: int
) -> Atlas: ...
def light_map(
    atlas: Atlas, bake: Bake, error: float, threads: int, progress: Report
) -> LightMap: ...
def view_factors(
    scene: Scene,
    error: float,
    two_sided: List[int],
    method: str,
    threads: int,
    progress: Report,
) -> Factors: ...
def load_factors(path: str) -> Factors: ...
def factors_of_rows(
    data: Floats,
    error: Floats,
    indices: NDArray[np.int64],
    starts: NDArray[np.int64],
    areas: Floats,
    names: List[str],
) -> Factors: ...
def heat(
    factors: Factors,
    temperature: Floats,
    net_flux: Floats,
    emissivity: Floats,
    surroundings: float,
    band_edges: List[float],
    threads: int,
) -> Dict[str, Any]: ...
