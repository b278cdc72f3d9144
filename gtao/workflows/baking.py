"""A table of specular occlusion as files: the work behind ``gtao bake``."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gtao import io, render, tables
from gtao.data.specular import SpecularTable
from gtao.errors import ConfigError

__all__ = ["BakeOutcome", "bake_table"]

#: Texels along every axis where none are asked for: errors are then below what the assumption of a cone costs.
DEFAULT_SIZES: dict[str, int | tuple[int, ...]] = {
    "brdf-4d": (24, 24, 16, 16),
    "brdf-5d": (16, 20, 12, 12, 8),
    "environment-brdf": 64,
}


@dataclass(frozen=True, eq=False)
class BakeOutcome:
    """What a bake left.

    Attributes:
        table: as it was written, with what its encoding keeps of the numbers.
        errors: of looking it up; None where the truth is not known.
        paths: the table first.
    """

    table: SpecularTable
    errors: tables.TableErrors | None
    paths: tuple[Path, ...]

    def summary(self) -> str:
        """The table, its errors, and how far the quadrature may be off."""
        off = self.table.settings["quadrature_error"]
        lines = [f"{self.table}, " + (f"quadrature within {off:.0e}" if off else "in closed form")]
        return "\n".join(lines + ([f"  {channel}" for channel in self.errors.channels] if self.errors else []))


def bake_table(
    kind: str,
    output: Path | str,
    *,
    size: int | Sequence[int] | None = None,
    axes: str | None = None,
    encoding: str | None = None,
    distribution: str = "ggx",
    bsdf: str | None = None,
    languages: Sequence[str] = (),
    report: Path | str | None = None,
    n_places: int = 20000,
    seed: int = 0,
    progress: Callable[[str, int, int], None] | None = None,
) -> BakeOutcome:
    """Bake a table, write it, and measure what looking it up is off by.

    Args:
        kind, axes, distribution: see :func:`gtao.tables.bake`.
        output: file whose suffix says how; see :func:`gtao.io.write_table`, as for ``encoding``.
        size: texels along every axis, or one number per axis; by default 32, and of tables of reflection fewer.
        bsdf: BSDF of Mitsuba with a parameter ``alpha`` in the place of GGX with Schlick's Fresnel term: its type, such
            as "roughplastic", or its dictionary as JSON.
        languages: also write the code that looks the table up, beside it: "hlsl", "glsl", "wgsl", "c".
        report: also write the errors, as a record.
        n_places, seed: places that errors are measured at.
        progress: called as ``progress(task, done, total)``.

    Raises:
        ConfigError: an option does not exist or does not go with the kind.
        ShapeError: the size does not go with the kind or the encoding.
        ImageError, RecordError: a file cannot be written.
    """
    size = DEFAULT_SIZES.get(kind, 32) if size is None else size
    if report is not None and bsdf is not None:
        raise ConfigError("the errors of tables of other BRDFs are not known; leave out the report")
    for language in languages:
        io.languages.language_of(language)
    files = io.table_files(output, (size, size) if isinstance(size, int) else size, encoding)
    codes = [Path(output).with_suffix(f".{language}") for language in languages]
    paths = [*files, *codes, *([] if report is None else [Path(report)])]
    for path in paths:
        if paths.count(path) > 1:
            raise ConfigError(f"{path} would be written twice; give the table or the report another name")
        io.ensure_writable(path)
    brdf = None if bsdf is None else _materials(bsdf)
    baked = tables.bake(kind, size, axes, distribution=distribution, brdf=brdf, progress=progress)
    texts = [io.table_code(baked, language) for language in languages]
    io.write_table(output, baked, encoding)
    for path, text in zip(codes, texts, strict=True):
        io.write_text(path, text)
    table = io.read_table(output)
    errors = None if bsdf is not None else tables.errors(table, n_places, seed)
    if report is not None and errors is not None:
        command = _command(table, files[0], encoding, languages, report, n_places, seed)
        record = io.provenance(command, seed=seed, config=dict(table.settings) | {"n_places": n_places})
        outputs = [io.file_entry(path, Path(report).parent) for path in (*files, *codes)]
        record |= {"kind": "errors of a table", "inputs": [], "outputs": outputs, "numbers": errors.to_dict()}
        io.write_record(report, record, overwrite=True)
    return BakeOutcome(table, errors, tuple(paths))


def _materials(bsdf: str) -> Callable[[float], Any]:
    """Of a type or a description, the BRDF for every width."""
    described: Any = {"type": bsdf}
    if bsdf.lstrip().startswith("{"):
        try:
            described = json.loads(bsdf)
        except ValueError as error:
            raise ConfigError(f"the bsdf is no JSON: {error}; give a type, or an object with one") from None
    return lambda alpha: render.brdf({**described, "alpha": alpha})


def _command(
    table: SpecularTable,
    output: Path,
    encoding: str | None,
    languages: Sequence[str],
    report: Path | str,
    n_places: int,
    seed: int,
) -> list[str]:
    size = ",".join(map(str, table.size))
    words = ["gtao", "bake", table.kind, "-o", io.portable(output), "--size", size, "--axes", table.axes]
    words += [] if encoding is None else ["--encoding", encoding]
    words += [] if table.kind != "cone-lobe" else ["--distribution", str(table.settings["distribution"])]
    words += [word for language in languages for word in ("--code", language)]
    return [*words, "--report", io.portable(Path(report)), "--places", str(n_places), "--seed", str(seed)]
