"""Methods of specular occlusion against rays, free of the noise of both."""

import numpy as np

from gtao import evaluate
from gtao.plot import MethodResult

from .frames import GlossyFrame
from .methods import occlusion_of

__all__ = ["errors", "occlusion"]


def occlusion(frame: GlossyFrame, source: str, name: str, roughness: float, f0: float) -> tuple[np.ndarray, np.ndarray]:
    """(H, W) occlusion as a method has it, and its variance by what it was given: two runs, or one without noise."""
    given = frame.given[source]
    images = [occlusion_of(name, frame.view.g, one, roughness, f0).astype(np.float64) for one in given]
    a, b = images[0], images[-1]
    return (a + b) / 2, (a - b) ** 2 / 4


def truth(frame: GlossyFrame, roughness: float) -> tuple[np.ndarray, np.ndarray]:
    """(H, W) ray-traced occlusion and its variance."""
    a, b = frame.truths[roughness]
    return (a + b) / 2, (a - b) ** 2 / 4


def errors(frame: GlossyFrame, source: str, name: str, roughness: float, f0: float) -> MethodResult:
    """One method, given one source of visibility, at one roughness."""
    mask = frame.view.mask
    (image, noise), (reference, variance) = occlusion(frame, source, name, roughness, f0), truth(frame, roughness)
    metrics: dict[str, float | None] = {
        "rmse": evaluate.corrected_rmse(image[mask], reference[mask], (noise + variance)[mask]),
        "bias": evaluate.bias(image[mask], reference[mask]),
    }
    return MethodResult(name=name, label=name, metrics=metrics, group=source, visibility=image)
