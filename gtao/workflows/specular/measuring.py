"""Methods of specular occlusion against rays, free of the noise of both."""

import numpy as np

from gtao import evaluate
from gtao.plot import MethodResult, SceneComparison

from .frames import GlossyFrame
from .methods import DENSE, EXACT, GAME, TRACED, occlusion_of

__all__ = ["STEPS", "Occlusions", "measured", "steps", "tilt", "truth_of"]

#: Image and its variance.
Noisy = tuple[np.ndarray, np.ndarray]

#: Source and method.
Stage = tuple[str, str]

#: What a step of the error is -> what is before it and after it; None stands for the truth.
STEPS: dict[str, tuple[Stage | None, Stage]] = {
    "visibility is a cone": (None, (TRACED, EXACT)),
    "table of five axes": ((TRACED, EXACT), (TRACED, "brdf-5d")),
    "no azimuth, table": ((TRACED, EXACT), (TRACED, "brdf-4d")),
    "bent normal for normal, table": ((TRACED, EXACT), (TRACED, "brdf-3d")),
    "lobe about the reflection": ((TRACED, EXACT), (TRACED, "cone-lobe")),
    "lobe is a cone": ((TRACED, "cone-lobe"), (TRACED, "cone-cone")),
    "published aperture": ((TRACED, "brdf-4d"), (TRACED, "brdf-4d-published")),
    "depth buffer": ((TRACED, EXACT), (DENSE, EXACT)),
    "few slices, filter": ((DENSE, EXACT), (GAME, EXACT)),
}


class Occlusions:
    """Occlusion of one frame as methods have it, each computed once: (source, name, roughness) -> its runs."""

    def __init__(self, frame: GlossyFrame, f0: float):
        self.frame, self.f0 = frame, f0
        self._found: dict[tuple[str, str, float], list[np.ndarray]] = {}

    def runs(self, source: str, name: str, roughness: float) -> list[np.ndarray]:
        """(H, W) occlusion: two independent runs where visibility is traced, else one."""
        key = source, name, roughness
        if key not in self._found:
            g, given = self.frame.view.g, self.frame.given[source]
            images = [occlusion_of(name, g, one, roughness, self.f0) for one in given]
            self._found[key] = [image.astype(np.float64) for image in images]
        return self._found[key]

    def image(self, source: str, name: str, roughness: float) -> Noisy:
        """(H, W) occlusion and its variance, 0 where it is of one run."""
        return pooled(self.runs(source, name, roughness))


def pooled(runs: list[np.ndarray]) -> Noisy:
    """Mean of one or two runs and its variance, 0 of one."""
    a, b = runs[0], runs[-1]
    return (a + b) / 2, (a - b) ** 2 / 4


def truth_of(frame: GlossyFrame, roughness: float) -> Noisy:
    """(H, W) ray-traced occlusion and its variance."""
    return pooled(list(frame.truths[roughness]))


def tilt(frame: GlossyFrame) -> float:
    """Root mean square angle between the normal and the traced bent normal of equal weights, degrees."""
    mask = frame.view.mask
    n = frame.view.g.normal_v.numpy()[mask]
    directions = sum(run["uniform"].mean_direction.numpy()[mask].astype(np.float64) for run in frame.given[TRACED])
    length = np.linalg.norm(directions, axis=-1)
    cosine = (n * directions).sum(-1)[length > 0] / length[length > 0]
    return float(np.degrees(np.sqrt(np.mean(np.arccos(np.clip(cosine, -1, 1)) ** 2))))


def measured(found: Occlusions, names: tuple[str, ...], roughness: float) -> SceneComparison:
    """Every method with every source of visibility, at one roughness."""
    frame = found.frame
    mask = frame.view.mask
    reference, variance = truth_of(frame, roughness)
    rows = []
    for source in frame.given:
        for name in names:
            image, noise = found.image(source, name, roughness)
            metrics: dict[str, float | None] = {
                "rmse": evaluate.corrected_rmse(image[mask], reference[mask], (noise + variance)[mask]),
                "bias": evaluate.bias(image[mask], reference[mask]),
            }
            rows.append(MethodResult(name=name, label=name, metrics=metrics, group=source))
    return SceneComparison(
        name=frame.view.name,
        radius=frame.view.radius,
        truth=reference,
        mask=mask,
        methods=rows,
        noise=evaluate.noise_floor(variance[mask]),
    )


def steps(found: Occlusions, names: tuple[str, ...], roughness: float) -> dict[str, float]:
    """Step -> root mean square of what it changes, without noise; of the steps whose methods all take part."""
    return {
        step: _root(found, before, after, roughness)
        for step, (before, after) in STEPS.items()
        if {name for _, name in filter(None, (before, after))} <= {*names}
    }


def _root(found: Occlusions, before: Stage | None, after: Stage, roughness: float) -> float:
    first = list(found.frame.truths[roughness]) if before is None else found.runs(*before, roughness)
    last = found.runs(*after, roughness)
    # Runs are paired: what both sides of a step have of the same rays is no noise of the difference.
    n = max(len(first), len(last))
    difference, variance = pooled([last[k % len(last)] - first[k % len(first)] for k in range(n)])
    mask = found.frame.view.mask
    return evaluate.corrected_rmse(difference[mask], np.zeros(mask.sum()), variance[mask])
