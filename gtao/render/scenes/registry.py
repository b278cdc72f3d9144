"""The list of embedded scenes: what each is, and how it is found by name."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from gtao.errors import ConfigError
from gtao.render.catalogue import Catalogue, summary

Kind = Literal["analytic", "procedural"]


@dataclass(frozen=True, kw_only=True)
class SceneInfo:
    """What is known of an embedded scene without building it.

    Attributes:
        name: the key for :func:`get` and :func:`build`, and the name of its function.
        kind: "analytic" (its visibility is known in closed form) or "procedural".
        description: one line.
        radius: a sensible ambient-occlusion radius, in scene units.
        solid: made of closed, thick objects; False for cards and foliage.
        views: what each sensor shows, in the order of the sensors.
        function: builds the scene dict.
        expected_visibility: analytic scenes: ``(position, **parameters) -> visibility``, where ``position`` (n, 3)
            are world points on surfaces that the sensors see, ``parameters`` are those of the scene's function,
            and the result (n,) is the cosine-weighted visibility in [0, 1].
        uniform: the expected visibility A is one constant at all that the sensors see and that paths from there
            meet, so that light transport is known too: see :func:`uniform_transport`.
    """

    name: str
    kind: Kind
    description: str
    radius: float
    solid: bool
    views: tuple[str, ...]
    function: Callable[..., dict]
    expected_visibility: Callable[..., Any] | None = None
    uniform: bool = False


_SCENES: Catalogue[SceneInfo] = Catalogue("scene")


def scene(**info: Any) -> Callable[[Callable[..., dict]], Callable[..., dict]]:
    """Decorator: enters a scene function into the list; its keywords are the fields of :class:`SceneInfo`.

    Name and description are the function's own name and the first line of its docstring.
    """

    def enter(function: Callable[..., dict]) -> Callable[..., dict]:
        name = function.__name__
        _SCENES.enter(name, SceneInfo(name=name, description=summary(function), function=function, **info))
        return function

    return enter


def names(kind: Kind | None = None) -> tuple[str, ...]:
    """Names of the embedded scenes, in a fixed order; of one kind if given.

    Raises:
        ConfigError: no such kind.
    """
    if kind not in (None, "analytic", "procedural"):
        raise ConfigError(f"kind must be 'analytic', 'procedural' or None, got {kind!r}")
    return tuple(name for name, info in _SCENES.items() if kind in (None, info.kind))


def get(name: str) -> SceneInfo:
    """What is known of the scene called ``name``.

    Raises:
        SceneError: there is none; the message lists those that exist.
    """
    return _SCENES.get(name)


def build(name: str, *, width: int = 128, height: int = 128, **parameters: Any) -> dict:
    """Scene dict of the scene called ``name``, for ``mi.load_dict``.

    Args:
        name: one of :func:`names`.
        width: of every sensor's image, in pixels.
        height: of every sensor's image, in pixels.
        **parameters: further parameters of the scene's function, ``reflectance`` among them.

    Raises:
        SceneError: no scene of that name.
        ConfigError: the scene has no such parameter, or its value is out of range.
    """
    return _SCENES.build(name, width, height, parameters)
