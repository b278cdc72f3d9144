"""Everything that a march is given, in one piece whose arrays can be exchanged by name."""

from dataclasses import dataclass, fields, replace
from typing import Any

import drjit as dr

from gtao.kernels import normals
from gtao.kernels.march import March
from gtao.kernels.march_types import Scalars, Switches

__all__ = ["Job"]

_AXES = ("normal.x", "normal.y", "normal.z")


@dataclass(frozen=True)
class Job:
    """The arguments of a march.

    Attributes:
        view_z: flat depth of the frame.
        normal: flat normals of the frame, three numbers per pixel.
        unit: how far a normal's length may be from 1 before it is normalised; None if they have been.
        field: the buffer that samples are read from.
        accumulator, switches, scalars, types: see :mod:`gtao.kernels.march`.
    """

    view_z: Any
    normal: Any
    unit: Any
    field: Any
    accumulator: Any
    switches: Switches
    scalars: Scalars
    types: Any

    @property
    def n(self) -> int:
        """Number of pixels."""
        return dr.width(self.view_z)

    def inputs(self) -> dict[str, Any]:
        """The floating-point arrays by name.

        The depth of the shaded points and the buffer that samples are read from are two inputs even where they are one
        array: a gradient that is added to and scattered into by turns would cost a kernel launch for every turn.
        """
        arrays = {name: getattr(self, name) for name in ("view_z", "normal", "field")}
        for name in ("accumulator", "scalars"):
            part = getattr(self, name)
            arrays |= {f"{name}.{f.name}": getattr(part, f.name) for f in fields(part)}
        return {name: a for name, a in arrays.items() if dr.is_array_v(a) and dr.is_float_v(a)}

    def with_inputs(self, inputs: dict[str, Any]) -> "Job":
        """The same job with some arrays replaced, by the names of :meth:`inputs`."""

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
        n = self._normals()
        if self.unit is not None:
            n = normals.unit(n, dr.isfinite(self.view_z), self.unit)
        return March.of(self.view_z, tuple(n), self.field, self.switches, self.scalars, self.types)

    def _normals(self):
        if isinstance(self.normal, tuple):
            return self.types.Array3(*self.normal)
        return dr.unravel(self.types.Array3, self.normal)

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
                result |= dict(zip(_AXES, dr.unravel(self.types.Array3, a), strict=True))
            elif name != "field":
                result[name] = type(a)(a) if name == "view_z" else dr.gather(self.types.Float, a, shared)
        return result

    def with_lanes(self, lanes: dict[str, Any]) -> "Job":
        """The same job with the arrays that :meth:`lanes` returned."""
        inputs = {name: a for name, a in lanes.items() if name not in _AXES}
        if _AXES[0] in lanes:
            inputs["normal"] = tuple(lanes[axis] for axis in _AXES)
        return self.with_inputs(inputs)

    def gathered(self, lanes: dict[str, Any]) -> dict[str, Any]:
        """Gradients of inputs from those of :meth:`lanes`, all evaluated in one launch."""
        packed = {name: a for name, a in lanes.items() if name not in _AXES}
        if _AXES[0] in lanes:
            packed["normal"] = dr.ravel(self.types.Array3(*(lanes[axis] for axis in _AXES)))
        # One that is looked at alone would launch the whole pass for itself.
        dr.eval(packed)
        alone = ("view_z", "normal", "field")
        return {name: a if name in alone else dr.sum(a) for name, a in packed.items()}
