"""What a comparison of methods hands to its report: plain numbers, arrays and results, joined by names."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from gtao.errors import ConfigError, ShapeError

__all__ = ["RMSE_IS", "Comparison", "MethodResult", "SceneComparison"]

#: What tables say of an RMSE.
RMSE_IS = "root of the mean squared error against the truth, with its noise"


@dataclass(frozen=True, kw_only=True)
class MethodResult:
    """One method on one scene, at one number of taps.

    Attributes:
        name: Key of the method, the same on every scene: rows of the tables are joined by ``(group, name)``.
        label: What readers see.
        metrics: Numbers by name, with "rmse" among them. Known names are "rmse", "corrected_rmse", "bias", "mae",
            "psnr", "ssim", "dssim" and "flip", as :func:`gtao.evaluate.scores` makes them, and "field_rmse", the RMSE
            against the height field instead of the scene; None for a number that does not exist.
        group: The table that the row belongs to, for example "18 taps per pixel" or "own defaults".
        taps: Depth samples per pixel.
        milliseconds: Time of the warm kernel for one frame.
        visibility: (H, W) image to show, or None to list the method in the tables only: every image adds some
            100 kB to the page.
        settings: The configuration, as a reader would have to write it.
        ours: Whether the row is emphasised as the library's own choice.
    """

    name: str
    label: str
    metrics: Mapping[str, float | None]
    group: str = ""
    taps: float | None = None
    milliseconds: float | None = None
    visibility: Any = None
    settings: str = ""
    ours: bool = False

    def __post_init__(self) -> None:
        if self.metrics.get("rmse") is None:
            raise ConfigError(f"metrics of {self.name} hold {sorted(self.metrics)}; the report sorts by 'rmse'")


@dataclass(frozen=True, kw_only=True)
class SceneComparison:
    """All methods on one view of one scene.

    Attributes:
        name: Name of the scene.
        radius: Greatest distance of an occluder in scene units; infinity for unlimited.
        truth: (H, W) ray-traced visibility.
        methods: Results, in any order.
        mask: (H, W) pixels that were compared; all if None. The others are drawn as background.
        noise: Root of the mean variance of the truth (:func:`gtao.evaluate.noise_floor`), or None.
        limit_rmse: RMSE of the best that a single depth layer can give (the dense height-field estimate), or None.
        budgets: :class:`gtao.evaluate.ErrorBudget` by label of the method; our own, or else the first, is also drawn as
            maps.
        curves: Label -> (taps per pixel, RMSE) pairs, for the error against samples.
        deviations: Label of a renderer -> (deviation, RMSE) pairs. The first pair is the estimator as published; each
            further one has one more deviation switched on.
        strata: Label of a method -> quantity -> :class:`gtao.evaluate.Strata`, from :func:`gtao.evaluate.stratify`.
        notes: Sentences to print with the scene.
    """

    name: str
    radius: float
    truth: Any
    methods: Sequence[MethodResult]
    mask: Any = None
    noise: float | None = None
    limit_rmse: float | None = None
    budgets: Mapping[str, Any] = field(default_factory=dict)
    curves: Mapping[str, Sequence[tuple[float, float]]] = field(default_factory=dict)
    deviations: Mapping[str, Sequence[tuple[str, float]]] = field(default_factory=dict)
    strata: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    notes: Sequence[str] = ()

    def __post_init__(self) -> None:
        if not self.methods:
            raise ConfigError(f"scene {self.name} has no method to compare; give at least one")
        keys = [(m.group, m.name) for m in self.methods]
        if len(set(keys)) < len(keys):
            raise ConfigError(f"scene {self.name} lists a method twice in one group; give names or groups of their own")
        for m in self.methods:
            if m.visibility is not None and tuple(m.visibility.shape) != tuple(self.truth.shape):
                raise ShapeError(
                    f"{m.name} on {self.name} has shape {tuple(m.visibility.shape)} and the truth "
                    f"{tuple(self.truth.shape)}; they must be equal"
                )


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Methods against ray-traced truth on any number of scenes.

    Attributes:
        scenes: At least one.
        title: Heading of the report.
        command: Command line that repeats it.
        versions: Version by name of package, device, commit: whatever pins the numbers down.
        record: The JSON record of the run, shown folded; None for none.
        notes: Sentences to print at the top.
        rmse_is: What the tables say of "rmse".
    """

    scenes: Sequence[SceneComparison]
    title: str = "Methods against ray-traced truth"
    command: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    record: Mapping[str, Any] | None = None
    notes: Sequence[str] = ()
    rmse_is: str = RMSE_IS

    def __post_init__(self) -> None:
        if not self.scenes:
            raise ConfigError("there is no scene to report; give at least one")

    def groups(self) -> tuple[str, ...]:
        """Groups of methods, in order of appearance."""
        return tuple(dict.fromkeys(m.group for scene in self.scenes for m in scene.methods))
