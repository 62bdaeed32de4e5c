"""Global illumination by hemicubes on Vulkan."""

from collections.abc import Callable
from os import PathLike
from typing import Any, Literal, final

import numpy as np
from numpy.typing import NDArray

__all__ = ["Bake", "Progress", "__version__", "bake"]

__version__: str

@final
class Progress:
    """What a bake has reached."""

    @property
    def sources_drawn(self) -> int: ...
    @property
    def sources(self) -> int: ...
    @property
    def unshot_share(self) -> float:
        """Of the emitted power."""
    @property
    def error_bound(self) -> float | None:
        """Power that can still be missing, over the emitted; None at a reflectance of 1."""
    @property
    def seconds(self) -> float: ...

@final
class Bake:
    """Light on the E elements of a scene, in scene units and W/m², RGB.

    Every array of the file is an attribute and an item: see docs/bake-format.md. Elements with
    relief add theirs, which keys() names.
    """

    vertices: NDArray[np.float32]
    """Corners, [element, corner, xyz]."""
    area: NDArray[np.float32]
    """[element]"""
    normal: NDArray[np.float32]
    """[element, xyz]"""
    material: NDArray[np.uint32]
    """[element]"""
    irradiance: NDArray[np.float32]
    """[element, rgb]"""
    irradiance_direct: NDArray[np.float32]
    """Of this the part straight from lamps, [element, rgb]."""
    radiosity: NDArray[np.float32]
    """[element, rgb]"""
    input_triangle: NDArray[np.uint32]
    """Triangle of the input in which each element lies, [element]."""
    @property
    def report(self) -> dict[str, Any]:
        """The solver's report, as `mesolux bake --json` prints it."""
    @property
    def notes(self) -> list[str]:
        """What was noted as the scene was read."""
    def keys(self) -> list[str]: ...
    def __getitem__(self, name: str, /) -> NDArray[Any]: ...
    def __len__(self) -> int: ...
    def save(self, path: str | PathLike[str]) -> None:
        """Write a .safetensors file that `mesolux render`, `view` and `export` open."""

def bake(
    scene: str | PathLike[str],
    *,
    quality: Literal["preview", "draft", "normal", "high", "reference"] = "normal",
    residual: float | None = None,
    patches: int | None = None,
    statue: str | PathLike[str] | None = None,
    directions: Literal[16, 32, 64, 128, 256] = 64,
    transport: Literal["physical", "paper", "lambert"] = "physical",
    element_size: float | None = None,
    fineness: float | None = None,
    max_elements: int | None = None,
    seed: int = 0,
    budget: float | None = None,
    shots: int | None = None,
    device: str | None = None,
    progress: bool | Callable[[Progress], bool | None] | None = None,
) -> Bake:
    """Bake a scene: a built-in name, an .obj, .gltf or .glb file, or a scene.toml.

    Settings are those of `mesolux bake`. `progress` is True for a line on stderr, or a function
    that is called with what has been reached; the bake stops, and keeps its light, where it
    returns False. Ctrl-C raises KeyboardInterrupt.

    Raises ValueError for a scene or a setting that cannot be used, RuntimeError for a device that
    is missing or fails, OSError for a file that cannot be written.
    """
