"""The list of embedded animations: what each is, and how it is found by name."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Any

from gtao.render.catalogue import Catalogue, summary
from gtao.render.sequence_animation import Animation

__all__ = ["AnimationInfo", "animation", "build", "get", "names"]


@dataclass(frozen=True, kw_only=True)
class AnimationInfo:
    """What is known of an embedded animation without building it.

    Attributes:
        name: the key for :func:`get` and :func:`build`, and the name of its function.
        description: one line.
        radius: a sensible ambient-occlusion radius, in scene units.
        n_frames: number of frames.
        static_camera: the camera never moves.
        static_scene: nothing but the camera moves.
        cut: first frame after a cut, None without; with one, ``n_frames`` is a parameter of the function, and the cut
            lies at half of them.
        function: builds the :class:`gtao.render.Animation`.
    """

    name: str
    description: str
    radius: float
    n_frames: int
    static_camera: bool = False
    static_scene: bool = False
    cut: int | None = None
    function: Callable[..., Animation]


_ANIMATIONS: Catalogue[AnimationInfo] = Catalogue("animation")


def animation(**info: Any) -> Callable[[Callable[..., dict]], Callable[..., Animation]]:
    """Decorator: enters an animation into the list; its keywords are the fields of :class:`AnimationInfo`.

    The function returns the rest of what :class:`gtao.render.Animation` needs: scene, camera and movers; where its own
    parameters change what the keywords say, that too.
    """

    def enter(function: Callable[..., dict]) -> Callable[..., Animation]:
        name, description = function.__name__, summary(function)

        @wraps(function)
        def make(*args: Any, **kwargs: Any) -> Animation:
            known = {key: info.get(key) for key in ("radius", "n_frames", "cut")}
            return Animation(name=name, description=description, **known | function(*args, **kwargs))

        _ANIMATIONS.enter(name, AnimationInfo(name=name, description=description, function=make, **info))
        return make

    return enter


def names() -> tuple[str, ...]:
    """Names of the embedded animations, in a fixed order."""
    return tuple(name for name, _ in _ANIMATIONS.items())


def get(name: str) -> AnimationInfo:
    """What is known of the animation called ``name``.

    Raises:
        SceneError: there is none; the message lists those that exist.
    """
    return _ANIMATIONS.get(name)


def build(name: str, *, width: int = 128, height: int = 128, **parameters: Any) -> Animation:
    """The animation called ``name``.

    Args:
        name: one of :func:`names`.
        width: of the image, in pixels.
        height: of the image, in pixels.
        **parameters: further parameters of the animation's function.

    Raises:
        SceneError: no animation of that name.
        ConfigError: the animation has no such parameter, or its value is out of range.
    """
    return _ANIMATIONS.build(name, width, height, parameters)
