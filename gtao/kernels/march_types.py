"""What the march is given, and what it tells an accumulator about pixels, slices and samples."""

from dataclasses import dataclass
from typing import Any

from . import pyramid, reach, steps

__all__ = ["Pixel", "Sample", "Scalars", "Slice", "Switches"]


@dataclass(frozen=True)
class Switches:
    """What specialises the kernel; everything else reaches it as an array and changes without recompiling."""

    width: int
    height: int
    orthographic: bool
    n_slices: int
    n_steps: int
    slice_measure: str
    slice_angles: tuple[float, ...] | None
    zenith: str
    fetch: str
    snap_to_texel: bool
    noise: str
    step_exponent: float | None  # None: the scalar of that name, which has derivatives
    step_law: str
    step_jitter: str
    border: str
    pyramid: pyramid.Table | None  # levels of the buffer that samples are read from
    unlimited: bool  # the radius is infinite
    clamp_px: bool
    square_pixels: bool  # fx = fy, neither with gradients
    pulled: bool  # the shaded point is moved toward the viewer
    meets_itself: bool  # a sample may be the shaded point itself

    @property
    def unrolled(self) -> bool:
        """Whether reverse mode goes through all samples: a symbolic loop over a running maximum has no adjoint."""
        return steps.block_length(self.n_steps) == self.n_steps

    @property
    def fixes_samples(self) -> bool:
        """Whether samples stay on the same texel when a length changes a little, so that they have no derivative."""
        return self.snap_to_texel and self.fetch in ("nearest", "floor")

    @property
    def leaves_frame(self) -> bool:
        """Whether a sample may lie off the frame, or off the part of it that the search was shortened to."""
        return self.border != "shorten" or self.step_law != "strata"

    @property
    def unit_directions(self) -> bool:
        """Whether the marching direction of a slice is a unit vector in pixels too."""
        return self.square_pixels and self.slice_measure != "view"


@dataclass(frozen=True)
class Scalars:
    """Kernel inputs of width one, opaque to the compiler, and the mask of noise where there is one."""

    ax: Any  # image-plane coordinate of texel column i: ax i + bx
    bx: Any
    ay: Any
    by: Any
    fx: Any
    fy: Any
    radius: Any
    step_exponent: Any
    min_step_px: Any
    max_radius_px: Any
    level_scale: Any  # of distances in pixels, see :func:`gtao.kernels.pyramid.level`
    pull: Any  # factor of the shaded point's depth
    frame_rotation: Any
    frame_offset: Any
    key: Any
    seed: Any = None  # of noise; None like the next two where the pattern has no use for it
    frame: Any = None
    mask: Any = None  # see :mod:`gtao.kernels.noise_mask`


@dataclass(frozen=True)
class Pixel:
    """The shaded point: texel coordinates, image-plane coordinates, position, unit vector to the viewer (zenith)."""

    x: Any
    y: Any
    X: Any
    Y: Any
    apart: tuple[Any, Any, Any]  # see :func:`gtao.kernels.horizon.apart_form`
    P: tuple[Any, Any, Any]
    p: Any  # distance from the eye; None in parallel projection
    V: tuple[Any, Any, Any]
    nV: Any


@dataclass(frozen=True)
class Slice:
    """One slice of a pixel: its number, azimuth, normal, the tangent plane's cosines, where its samples lie."""

    pixel: Pixel
    index: Any
    azimuth: tuple[Any, Any]  # (cos, sin) as the slice measure counts
    nV: Any
    nT: Any
    start: tuple[Any, Any]
    direction: tuple[Any, Any]  # unit vector in pixels, y down, toward +T
    sides: tuple[reach.Side, reach.Side]
    offset: Any  # of its steps, in [0, 1)

    @property
    def inside(self):
        """Which sides have any samples."""
        return tuple(side.inside for side in self.sides)


@dataclass(frozen=True)
class Sample:
    """One depth sample: offset D from the shaded point, ⟨D, V⟩, its cosine, where it was read and what."""

    D: tuple[Any, Any, Any]
    d2: Any
    dV: Any
    c: Any  # NaN for the background, which is infinitely far: it compares false
    j: Any  # number of the step
    x: Any
    y: Any
    X: Any
    Y: Any
    z: Any

    def offset(self, pixel: Pixel):
        """Difference of the texel coordinates to the shaded point's."""
        return self.x - pixel.x, self.y - pixel.y
