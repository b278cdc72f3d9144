"""Image operations that are one kernel forward and one kernel for all their gradients.

Plain reverse mode launches kernels that repeat the stage, one whenever it changes from adding to the gradient of an
image to scattering into it, and one for every use of a number. Here a stage is an operation of its own: a pixel's own
value, what its neighbours read and every number become variables of their own, as wide as the image, and their
gradients are evaluated together.
"""

from collections.abc import Callable
from typing import Any

import drjit as dr

from .kernels.filters import Image
from .tensors import scalar

__all__ = ["Stage", "staged"]

#: ``stage(images, numbers)``: from an :class:`gtao.kernels.filters.Image` each and numbers, of width one or, where they
#: have gradients, as wide as the stage, to a tuple of flat arrays.
Stage = Callable[[tuple[Image, ...], tuple[Any, ...]], tuple[Any, ...]]


def staged(
    stage: Stage, images: tuple[Any, ...], numbers: tuple[Any, ...] = (), *, lanes: int | None = None
) -> tuple[Any, ...]:
    """What ``stage`` makes of flat images and numbers, evaluated where any of them carries a gradient.

    Args:
        stage: computes the result; whatever else it knows is taken for constant.
        images: flat arrays, one value per pixel.
        numbers: Python numbers or Dr.Jit floats of width one.
        lanes: how many the stage runs on, where the result is not of the size of the images.
    """
    numbers = tuple(scalar(value, type(images[0])) for value in numbers)
    attached = tuple(map(dr.grad_enabled, (*images, *numbers)))
    if any(attached):
        return dr.custom(_Staged, stage, images, numbers, attached, lanes)
    return stage(tuple(Image(v, v) for v in images), numbers)


class _Staged(dr.CustomOp):
    def eval(self, stage, images, numbers, attached, lanes):
        self.stage, self.inputs, self.attached = stage, (images, numbers), attached
        self.lanes = dr.width(images) if lanes is None else lanes
        result = stage(tuple(Image(v, v) for v in images), numbers)
        dr.eval(result)
        return result

    def _variables(self):
        """Images as their own and as neighbours read them, and numbers as wide as the stage."""
        images, numbers = self.inputs
        n = len(images)
        own, around = ([type(v)(v) for v in images] for _ in range(2))
        numbers = list(numbers)
        for i, attached in enumerate(self.attached):
            if attached and i < n:
                dr.enable_grad(own[i], around[i])
            elif attached:
                numbers[i - n] = numbers[i - n] + dr.zeros(type(numbers[i - n]), self.lanes)
                dr.enable_grad(numbers[i - n])
        return own, around, numbers

    def _result(self, own, around, numbers):
        return self.stage(tuple(Image(*pair) for pair in zip(own, around, strict=True)), tuple(numbers))

    def backward(self):
        with dr.resume_grad():
            own, around, numbers = self._variables()
            result = self._result(own, around, numbers)
            dr.set_grad(result, self.grad_out())
            dr.enqueue(dr.ADMode.Backward, result)
            dr.traverse(dr.ADMode.Backward)
            gradients = dr.grad((own, around, numbers))
        # All in one kernel: reading one of them alone would run the stage for it.
        dr.eval(gradients)
        own, around, wide = gradients
        self.set_grad_in("images", tuple(a + b for a, b in zip(own, around, strict=True)))
        self.set_grad_in("numbers", tuple(map(dr.sum, wide)))

    def forward(self):
        with dr.resume_grad():
            own, around, numbers = self._variables()
            for variables, gradients in ((own, "images"), (around, "images"), (numbers, "numbers")):
                for variable, gradient in zip(variables, self.grad_in(gradients), strict=True):
                    if dr.grad_enabled(variable):
                        dr.set_grad(variable, gradient)
            result = self._result(own, around, numbers)
            dr.enqueue(dr.ADMode.Forward, own, around, numbers)
            dr.traverse(dr.ADMode.Forward)
            self.set_grad_out(dr.grad(result))

    def name(self):
        return "stage"
