"""What a transport render returns."""

from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from gtao import display

__all__ = ["Transport"]


@dataclass(frozen=True, kw_only=True)
class Transport:
    """Exact counts of walks, per batch, bounce and pixel.

    Attributes:
        escaped: (n_batches, K, N) walks that left the scene after exactly k = 1..K surfaces; uint16 or
            uint32.
        remaining: (n_batches, N) walks still inside after K surfaces. ``escaped.sum(1) + remaining`` is
            ``spp // n_batches`` exactly (theory, eq. (36)).
        pixel: (N,) flat index ``y * width + x`` of the pixels that show a surface, ascending.
        edge: (N,) True where depth jumps to a neighbouring pixel.
        width, height: of the image.
        spp: walks per pixel, over all batches.
        n_batches: mutually independent batches.
        n_bounces: K.
        seed: of the random numbers.
    """

    escaped: np.ndarray
    remaining: np.ndarray
    pixel: np.ndarray
    edge: np.ndarray
    width: int
    height: int
    spp: int
    n_batches: int
    n_bounces: int
    seed: int

    def _image(self, values: np.ndarray, background: float) -> np.ndarray:
        image = np.full((*values.shape[:-1], self.height * self.width), background, dtype=np.float32)
        image[..., self.pixel] = values
        return image.reshape(*values.shape[:-1], self.height, self.width)

    @property
    def T(self) -> np.ndarray:
        """(K, H, W) float32 mean share of walks that escape after k bounces; the background has T_1 = 1."""
        image = self._image(self.escaped.sum(0, dtype=np.int64) / self.spp, 0.0)
        image[0] = self.visibility
        return image

    @property
    def visibility(self) -> np.ndarray:
        """(H, W) single-bounce visibility, T_1."""
        return self._image(self.escaped[:, 0].sum(0, dtype=np.int64) / self.spp, 1.0)

    @property
    def remainder(self) -> np.ndarray:
        """(H, W) share of walks still inside after K bounces; 0 on the background."""
        return self._image(self.remaining.sum(0, dtype=np.int64) / self.spp, 0.0)

    @property
    def variance(self) -> np.ndarray:
        """(K, H, W) variance of the mean T_k, from the batches; 0 on the background.

        A single pixel has ``n_batches - 1`` degrees of freedom: pool before testing.
        """
        total = self.escaped.sum(0, dtype=np.int64)
        squares = sum(np.square(batch, dtype=np.int64) for batch in self.escaped)
        between = (self.n_batches * squares - total**2) / (self.n_batches - 1)
        return self._image(between / self.spp**2, 0.0)

    def _repr_png_(self) -> bytes:
        return display.grey_png(mi.TensorXf(self.visibility))

    def __repr__(self) -> str:
        return f"Transport({self.width}x{self.height}, {self.n_bounces} bounces, {self.spp} walks per pixel)"
