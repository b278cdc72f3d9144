"""The data of a multi-bounce fit: the path counts of all its scenes."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ConfigError, FitError

from .scene import SceneSamples, scene_samples

__all__ = ["Samples"]


@dataclass(frozen=True, eq=False)
class Samples:
    """All scenes of a fit. Build with :meth:`from_transports`."""

    scenes: tuple[SceneSamples, ...]
    cache: dict[Any, Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        if not self.scenes:
            raise FitError("there is no scene to fit; give at least one transport")
        names = [scene.name for scene in self.scenes]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ConfigError(f"scene names must differ, {', '.join(twice)} came more than once")
        sizes = {(scene.n_batches, scene.paths_per_batch) for scene in self.scenes}
        if len(sizes) > 1:
            text = ", ".join(f"{b} x {p}" for b, p in sorted(sizes))
            raise ConfigError(f"scenes must have the same batches x paths, got {text}; trace them alike")

    @classmethod
    def from_transports(
        cls,
        transports: Iterable[tuple[str, Any]],
        *,
        edges: Literal["keep", "drop"] = "keep",
        weights: Mapping[str, float] | None = None,
        regressors: Mapping[str, ArrayLike] | None = None,
    ) -> "Samples":
        """Collect the counts of several scenes.

        Args:
            transports: Pairs of a scene name and a transport: any object with ``escaped`` (batches, K, N),
                ``remaining`` (batches, N), ``spp``, ``pixel`` (N,), ``width`` and, for ``edges="drop"``,
                ``edge`` (N,) bool.
            edges: Whether pixels on depth edges take part.
            weights: Weight of scenes by name, positive; 1 for the others.
            regressors: Visibility to fit on instead of the ray-traced one, by scene name (all scenes or
                none): what a screen-space estimator says, either per valid pixel (N,) or as an image (H, W).
                Values are clamped to [0, 1], where the shader will clamp them too.

        Returns:
            The samples.

        Raises:
            ConfigError: A name comes twice or is unknown, a weight is not positive, ``edges`` is neither
                word.
            FitError: There is no scene, or a scene has no pixel.
            ShapeError: Shapes do not match, counts do not add up, a regressor is not finite.
        """
        if edges not in ("keep", "drop"):
            raise ConfigError(f"edges must be 'keep' or 'drop', got {edges!r}")
        transports = list(transports)
        names = [name for name, _ in transports]
        for what, given in (("weights", weights), ("regressors", regressors)):
            unknown = sorted(set(given or ()) - set(names))
            if unknown:
                raise ConfigError(f"{what} name no such scene: {', '.join(unknown)}; there are {', '.join(names)}")
        if regressors is not None and set(regressors) != set(names):
            raise ConfigError(f"regressors miss the scenes {', '.join(sorted(set(names) - set(regressors)))}")
        return cls(
            tuple(
                scene_samples(
                    name,
                    t,
                    edges,
                    (weights or {}).get(name, 1.0),
                    None if regressors is None else regressors[name],
                )
                for name, t in transports
            )
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the scenes."""
        return tuple(scene.name for scene in self.scenes)

    def check(self, bounces: float, albedos: ArrayLike) -> np.ndarray:
        """Check what is asked of the samples.

        Args:
            bounces: Surface bounces, counting the visible point: 2, 3, … up to the counted ones, or ``inf``.
            albedos: Albedos in (0, 1), at least one, all different.

        Returns:
            The albedos as an array.

        Raises:
            ConfigError: A value is outside its range, or more bounces than counted.
        """
        values = np.atleast_1d(np.asarray(albedos, float))
        if values.ndim != 1 or values.size == 0:
            raise ConfigError("albedos must be a list of at least one number")
        if not np.all((values > 0) & (values < 1)):
            raise ConfigError(f"albedos must lie strictly between 0 and 1, got {values.tolist()}")
        if np.unique(values).size < values.size:
            raise ConfigError(f"albedos must differ, got {values.tolist()}")
        if not (bounces >= 2 and (math.isinf(bounces) or float(bounces).is_integer())):
            raise ConfigError(f"bounces must be 2, 3, … or inf, got {bounces}; 1 is visibility itself")
        counted = min(scene.n_bounces for scene in self.scenes)
        if not math.isinf(bounces) and bounces > counted:
            raise ConfigError(f"bounces is {bounces:g} but only {counted} were counted; trace more or use inf")
        return values
