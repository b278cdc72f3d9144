"""The methods of an animation, from the words of a command line."""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

from gtao import io
from gtao.config import (
    GTAO,
    HBAO,
    NAMED,
    HeightfieldHorizon,
    HeightfieldRayMarch,
    Pipeline,
    VisibilityBitmask,
    method_from_dict,
)
from gtao.errors import ConfigError, GtaoError
from gtao.io.jsontext import read_json
from gtao.workflows.options import changed_pipeline, pipeline_from_options

__all__ = ["PIPELINES", "Method", "methods_of"]

#: Pipelines that remember, each with one radius to set, beside the methods of :data:`gtao.config.NAMED`.
PIPELINES: dict[str, Callable[[float], Pipeline]] = {
    "published-pipeline": Pipeline.as_published,
    "recommended-temporal": partial(Pipeline.recommended, temporal=True),
}

#: What a file can describe.
_KINDS = [kind.__name__ for kind in (Pipeline, GTAO, HBAO, VisibilityBitmask, HeightfieldHorizon, HeightfieldRayMarch)]


@dataclass(frozen=True)
class Method:
    """One method.

    Attributes:
        name: as it was given.
        file: what its files are called.
        pipeline: the stages.
    """

    name: str
    file: str
    pipeline: Pipeline

    @property
    def forgetful(self) -> Pipeline | None:
        """The same without its temporal stage, or None where there is none: the estimate without a past."""
        return None if self.pipeline.temporal is None else replace(self.pipeline, temporal=None)


def methods_of(given: Sequence[str], settings: Sequence[str], radius: float) -> list[Method]:
    """Methods from ``NAME[,KEY=VALUE…]`` or ``FILE.json[,KEY=VALUE…]``, with file names of their own.

    Args:
        given: the methods.
        settings: options of all of them, before those of each.
        radius: in scene units, for methods that go by a name.

    Raises:
        ConfigError: a method or an option does not exist, or has a wrong value, or a file describes no method.
    """
    found: list[Method] = []
    for text in given:
        name, *own = text.split(",")
        options = [*settings, *own]
        described = _of_file(Path(name)) if name.endswith(".json") else None
        if described is None and name not in PIPELINES and name not in NAMED:
            raise ConfigError(f"method must be one of {', '.join((*PIPELINES, *NAMED))}, or a .json file, got {name!r}")
        try:
            if described is not None:
                pipeline = changed_pipeline(described, options)
            else:
                pipeline = pipeline_from_options(name, options, radius, others=PIPELINES)
        except ConfigError as cause:
            # Presets derive other lengths from the radius, of which an error then speaks.
            reach = "" if math.isfinite(radius) else " with radius inf"
            raise ConfigError(f"method {text}{reach}: {cause}") from None
        shown = ",".join([Path(name).stem if name.endswith(".json") else name, *own])
        found.append(Method(shown, _file_name(shown, {m.file for m in found}), pipeline))
    return found


def _of_file(path: Path) -> Pipeline:
    try:
        content = io.with_infinities(read_json(path, "method", advice="mend the file"))
        if not _describes_a_method(content):
            raise ConfigError(f'it describes none; such a file is an object whose "type" is {" or ".join(_KINDS)}')
        described = method_from_dict(content)
    except GtaoError as cause:
        raise ConfigError(f"cannot take a method from {path}: {cause}") from None
    return described if isinstance(described, Pipeline) else Pipeline(occlusion=described, clamp=False)


def _describes_a_method(content: Any) -> bool:
    """Whether it is an object of one of the kinds, which may be left out of a :class:`gtao.GTAO`."""
    if not isinstance(content, dict):
        return False
    if "type" not in content:
        return content.keys() <= {f.name for f in fields(GTAO)}
    return content["type"] in _KINDS


def _file_name(name: str, taken: set[str]) -> str:
    """The name with what file names and links bear; "truth" stands for the truth."""
    base = re.sub(r"[^A-Za-z0-9.-]+", "-", name).strip("-.") or "method"
    candidate, n = base, 2
    while candidate in taken or candidate == "truth":
        candidate, n = f"{base}-{n}", n + 1
    return candidate
