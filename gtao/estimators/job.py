"""Everything that a march is given, in one piece whose arrays can be exchanged by name."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr

from gtao.kernels import normals
from gtao.kernels.march import March
from gtao.kernels.march_types import Scalars, Switches

__all__ = ["Job"]

_AXES = ("normal.x", "normal.y", "normal.z")


@dataclass(frozen=True)
class Rows:
    """A band of rows: its first one and the first one that no band before it has, opaque integers, and their number."""

    first: Any
    new: Any
    number: int


@dataclass(frozen=True)
class Job:
    """The arguments of a march.

    Attributes:
        view_z: flat depth of the frame.
        normal: flat normals of the frame, three numbers per pixel.
        unit: how far a normal's length may be from 1 before it is normalised; None if they have been.
        field: the buffer that samples are read from.
        accumulator, switches, scalars, types: see :mod:`gtao.kernels.march`.
        rows: which rows to shade; None for all.
    """

    view_z: Any
    normal: Any
    unit: Any
    field: Any
    accumulator: Any
    switches: Switches
    scalars: Scalars
    types: Any
    rows: Rows | None = None

    @property
    def n(self) -> int:
        """Number of pixels to shade."""
        k = self.switches
        return k.width * (k.height if self.rows is None else self.rows.number)

    def inputs(self) -> dict[str, Any]:
        """The floating-point arrays by name.

        The depth of the shaded points and the buffer that samples are read from are two inputs even where they are one
        array: a gradient that is added to and scattered into by turns would cost a kernel launch for every turn.
        """
        arrays = {name: getattr(self, name) for name in ("view_z", "normal", "field")}
        for name in ("accumulator", "scalars"):
            arrays |= {f"{name}.{key}": value for key, value in vars(getattr(self, name)).items()}
        return {name: a for name, a in arrays.items() if dr.is_array_v(a) and dr.is_float_v(a)}

    def with_inputs(self, inputs: dict[str, Any]) -> "Job":
        """The same job with some arrays replaced, by the names of :meth:`inputs`."""
        if not inputs:
            return self

        def of(prefix):
            return {name.removeprefix(prefix): v for name, v in inputs.items() if name.startswith(prefix)}

        return replace(
            self,
            **{name: v for name, v in inputs.items() if "." not in name},
            accumulator=replace(self.accumulator, **of("accumulator.")),
            scalars=replace(self.scalars, **of("scalars.")),
        )

    def march(self) -> March:
        """Ready to be marched."""
        return self.march_of({})[0]

    def march_of(self, lanes: dict[str, Any]) -> tuple[March, Any]:
        """Ready to be marched with some of what :meth:`lanes` returns, and the accumulator to do it with."""
        job = self.with_inputs({name: a for name, a in lanes.items() if name != "view_z" and name not in _AXES})
        view_z = lanes["view_z"] if "view_z" in lanes else self.own(self.view_z)
        n = self.types.Array3(*(lanes[a] for a in _AXES)) if _AXES[0] in lanes else self._own3(self.normal)
        if self.unit is not None:
            n = normals.unit(n, dr.isfinite(view_z), self.unit)
        first_row = None if self.rows is None else self.rows.first
        march = March.of(view_z, tuple(n), job.field, job.switches, job.scalars, job.types, first_row)
        return march, job.accumulator

    def bands(self, max_pixels: int) -> Iterator["Job"]:
        """The same job for some rows after the other, of at most so many pixels each but one row at least.

        All bands have the same size, so that one kernel serves them; the last one may overlap the one before it.
        """
        k = self.switches
        n_rows = max(1, min(k.height, max_pixels // k.width))
        for first in range(0, k.height, n_rows):
            start, new = (dr.opaque(self.types.UInt, row) for row in (min(first, k.height - n_rows), first))
            yield replace(self, rows=Rows(start, new, n_rows))

    def row(self, y: int) -> "Job":
        """The same job for the pixels of row ``y`` alone."""
        start = dr.opaque(self.types.UInt, y)
        return replace(self, rows=Rows(start, start, 1))

    def lane_index(self):
        """Numbers of the pixels in the frame."""
        index = dr.arange(self.types.UInt, self.n)
        return index if self.rows is None else index + self.rows.first * self.switches.width

    def own(self, array):
        """The pixels' own elements of an array of the frame, as a variable of its own."""
        return type(array)(array) if self.rows is None else dr.gather(self.types.Float, array, self.lane_index())

    def new(self, seed):
        """An array of these pixels, 0 where a band before has the pixel too."""
        if self.rows is None:
            return seed
        return dr.select(self.lane_index() >= self.rows.new * self.switches.width, seed, 0)

    def _own3(self, flat):
        """The same of three numbers per pixel."""
        first = self.lane_index() * 3
        return self.types.Array3(*(dr.gather(self.types.Float, flat, first + axis) for axis in range(3)))

    def lanes(self, arrays: dict[str, Any]) -> dict[str, Any]:
        """Inputs with one number for every pixel and axis: what a pixel contributes to a gradient stays with it.

        Args:
            arrays: inputs, or tangents of inputs, by the names of :meth:`inputs`.

        Returns:
            The same without "field", whose texels belong to no pixel; "normal" as three arrays; and numbers that all
            pixels share repeated for each.
        """
        shared = dr.zeros(self.types.UInt, self.n)
        result = {}
        for name, a in arrays.items():
            if name == "normal":
                result |= dict(zip(_AXES, self._own3(a), strict=True))
            elif name != "field":
                result[name] = self.own(a) if name == "view_z" else dr.gather(self.types.Float, a, shared)
        return result

    def packed(self, lanes: dict[str, Any]) -> dict[str, Any]:
        """What :meth:`lanes` took apart: "normal" in one array again."""
        result = {name: a for name, a in lanes.items() if name not in _AXES}
        if _AXES[0] in lanes:
            result["normal"] = dr.ravel(self.types.Array3(*(lanes[axis] for axis in _AXES)))
        return result

    def collect(self, gradients: dict[str, Any], packed: dict[str, Any]) -> None:
        """Enter the gradients of these pixels into those of the frame."""
        for name, a in packed.items():
            if name not in ("view_z", "normal"):
                gradients[name] = gradients.get(name, 0) + dr.sum(a)
            elif self.rows is None:
                gradients[name] = a
            else:
                n_channels = dr.width(a) // self.n
                of_frame = self.view_z if name == "view_z" else self.normal
                if name not in gradients:
                    gradients[name] = dr.empty(type(a), dr.width(of_frame))
                row = self.switches.width * n_channels
                index = dr.arange(self.types.UInt, dr.width(a)) + self.rows.first * row
                dr.scatter(gradients[name], a, index, index >= self.rows.new * row)
                dr.eval(gradients[name])
