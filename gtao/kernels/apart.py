"""One array as two variables of the graph of derivatives."""

from typing import Any

import drjit as dr

__all__ = ["apart"]


class _Apart(dr.CustomOp):
    def eval(self, array):
        return type(array)(array), type(array)(array)

    def forward(self):
        grad = self.grad_in("array")
        self.set_grad_out((grad, grad))

    def backward(self):
        grads: Any = self.grad_out()
        own, tapped = grads
        dr.eval(own, tapped)
        self.set_grad_in("array", own + tapped)

    def name(self):
        return "apart"


def apart(array):
    """``array`` twice, once for a kernel's own texels and once for those that it gathers.

    The adjoint of the first adds, that of the second scatters; of a single variable every change from one to the other
    would launch a kernel of its own.
    """
    return dr.custom(_Apart, array) if dr.grad_enabled(array) else (array, array)
