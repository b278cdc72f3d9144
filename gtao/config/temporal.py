"""The temporal filter: accumulation of frames along the motion of what they show."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from gtao.errors import ConfigError

from ._checks import check_choice, check_flag, check_number, check_positive
from .codec import to_dict

if TYPE_CHECKING:
    from gtao.gbuffer import GBuffer
    from gtao.history import History
    from gtao.results import AmbientOcclusion

__all__ = ["TemporalFilter"]

Derivatives = Literal["none", "first"]


@dataclass(frozen=True, kw_only=True)
class TemporalFilter:
    """The slides' temporal filter (Jimenez et al. 2016): the mean of the frames so far, followed along their motion.

    A pixel interpolates the history where it was in the previous frame; each of the four texels there counts as far
    as its depth says that it shows the same surface, and the frame at hand fills what is missing. What the slides do
    not say is chosen here: ``disocclusion``, the slope of surfaces, both numbers of frames and the velocity weight.

    Numbers may be Dr.Jit floats of width 1, which may carry gradients.

    Args:
        frames: convergence time, at least 1: the mean of all frames up to there, then an exponential one in which a
            new frame counts 1/frames. ``inf`` never forgets.
        moving_frames: convergence time of what moves by ``moving_speed_px`` or more, in [1, ``frames``]. In between
            the weight of a new frame rises linearly.
        moving_speed_px: pixels per frame.
        disocclusion: how much nearer than the surface a texel of the history may lie, as a share of depth, until it
            counts nothing: the surface was hidden. Linear ramp.
        covering: how much farther; ``inf`` as in the slides never rejects what a nearer surface now hides.
        crease: angle between the normals of a pixel and of a texel of the history, from 0.01 to π, at which that counts
            nothing: it lies beyond a crease, where depths tell nothing. The weight is linear in the cosine. None, as in
            the slides, looks at no normals. They turn with the camera where both frames have poses; those of objects
            that turn by themselves are compared as they are.
        derivatives: "first" expects depth to change between texels as it does in this frame, which keeps the history
            of slopes; "none", as in the slides, takes slopes for disocclusions.
        clamp: keep the history within the range of the frame around the pixel, of means of 2×2 pixels.
        clamp_window: how far beyond, in widths of the range, where the velocity weight is 1.
        deviation_window: how much farther, in mean deviations of a pixel's frames from its history, which the history
            then keeps too: noise does not call the clamp. 0 as in the slides.
        velocity_weighting: whether that weight falls to 0, at a difference of ``velocity_scale_px`` between a pixel's
            motion and that of what was seen at its place before; otherwise it is 1.
        velocity_scale_px: pixels per frame.
    """

    frames: Any = 24.0
    moving_frames: Any = 8.0
    moving_speed_px: Any = 16.0
    disocclusion: Any = 0.1
    covering: Any = math.inf
    crease: Any = None
    derivatives: Derivatives = "first"
    clamp: bool = True
    clamp_window: Any = 0.5
    deviation_window: Any = 0.0
    velocity_weighting: bool = True
    velocity_scale_px: Any = 4.0

    def __post_init__(self) -> None:
        for name in ("frames", "moving_frames"):
            if not check_number(name, getattr(self, name)) >= 1:
                raise ConfigError(f"{name} must be at least 1, got {getattr(self, name)!r}")
        if check_number("moving_frames", self.moving_frames) > check_number("frames", self.frames):
            raise ConfigError(
                f"moving_frames must not exceed frames, got {self.moving_frames!r} and {self.frames!r}; give both"
            )
        check_positive("moving_speed_px", self.moving_speed_px, infinite=True)
        check_positive("disocclusion", self.disocclusion)
        check_positive("covering", self.covering, infinite=True)
        if self.crease is not None and not 0.01 <= check_number("crease", self.crease) <= math.pi:
            raise ConfigError(f"crease must be None or an angle from 0.01 to pi, got {self.crease!r}")
        check_choice("derivatives", self.derivatives, Derivatives)
        check_flag("clamp", self.clamp)
        for name in ("clamp_window", "deviation_window"):
            if not 0 <= check_number(name, getattr(self, name)) < math.inf:
                raise ConfigError(f"{name} must be finite and not negative, got {getattr(self, name)!r}")
        check_flag("velocity_weighting", self.velocity_weighting)
        check_positive("velocity_scale_px", self.velocity_scale_px)

    @classmethod
    def as_published(cls) -> "TemporalFilter":
        """As the slides print it: depths are compared without regard to slopes.

        Their depth scale, convergence times and velocity weight are not printed; these are the defaults here.
        """
        return cls(derivatives="none")

    @classmethod
    def recommended(cls) -> "TemporalFilter":
        """What errs less in motion than the slides' filter, and mostly flickers less, though not on every image.

        Numbers are on the page "From one direction per pixel to a still image" (docs/temporal). Depths are compared in
        both directions, normals too, and the clamp's window is as wide as the noise, not as the range. The search that
        chose the numbers is ``fits/temporal/2026-11`` in the repository.
        """
        return cls(disocclusion=0.05, covering=0.05, crease=1.0, clamp_window=0.0, deviation_window=1.0)

    def step(self, ao: "AmbientOcclusion", g: "GBuffer", history: "History | None" = None) -> "AmbientOcclusion":
        """The estimate ``ao`` of frame ``g``, accumulated with those that ``history`` has taken, which takes this one.

        Motion is that of ``g``, else that of a still scene if both frames have poses, else none. Directions are
        turned with the camera if both frames have poses.

        Args:
            ao: from :func:`gtao.ambient_occlusion` or :func:`gtao.denoise`.
            g: the frame that ``ao`` was estimated from.
            history: changed in place, at the very end: an error leaves it as it was. None for a single frame.

        Returns:
            A new estimate with the same ``config``; the first frame is ``ao`` itself. The background stays 1, and 0
            in directions. Gradients flow through this frame; the history has none.

        Raises:
            ConfigError: ``ao`` is no estimate, ``g`` no frame or ``history`` no history, or it holds other channels;
                or a function is being recorded by ``dr.freeze``, which would replay the first frame's history.
            ShapeError: the estimate is not of this frame, or the history of frames of another size.
        """
        from gtao.estimators.temporal import accumulate

        return accumulate(ao, g, self, history)

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)
