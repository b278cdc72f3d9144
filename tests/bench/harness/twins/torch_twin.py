"""The estimator in PyTorch, eager, with gradients by its autograd through every sample of the search."""

import numpy as np
import torch

from .convention import PACKAGE
from .noise import directions, pattern

__all__ = ["Twin"]

#: An arc cosine has no finite derivative at 1.
BELOW_ONE = 1 - 1e-6
#: A sample that is held at the border may be the shaded point itself.
TINY = 1e-12


class Twin:
    """A frame and a work as tensors, on one thread or more of the CPU."""

    def __init__(self, frame, work, convention=PACKAGE, threads=1):
        torch.set_num_threads(threads)
        self.work, self.held = work, convention.held
        self.view_z = torch.from_numpy(frame.view_z.ravel().copy())
        self.normal = [torch.from_numpy(n.ravel().copy()) for n in np.moveaxis(frame.normal_v, -1, 0)]
        y, x = np.divmod(np.arange(work.n_pixels), work.width)
        self.x, self.y = (torch.from_numpy(a.astype(np.float32)) for a in (x, y))
        rotation, jitter = pattern(range(work.height), range(work.width))
        self.jitter = torch.from_numpy(jitter.ravel())
        tables = directions(work.n_slices, convention.y_down)
        self.directions = [torch.from_numpy(table[:, rotation.ravel()]) for table in tables]

    def value(self):
        """Visibility, (H, W)."""
        with torch.no_grad():
            return self._visibility(self.view_z, self.normal).reshape(self.work.height, self.work.width).numpy()

    def value_and_gradient(self):
        """The mean of (visibility - 1/2)², and its gradients by depth, (H, W), and normals, (H, W, 3)."""
        inputs = [t.detach().requires_grad_() for t in (self.view_z, *self.normal)]
        loss = ((self._visibility(inputs[0], inputs[1:]) - 0.5) ** 2).mean()
        loss.backward()
        shape = self.work.height, self.work.width
        d_z, *d_n = (t.grad.numpy().reshape(shape) for t in inputs)
        return float(loss.detach()), d_z, np.stack(d_n, axis=-1)

    def _visibility(self, view_z, N):
        work = self.work
        rcp_f = 1 / work.focal_px
        scale, offset = -1 / (work.radius - work.full), work.radius / (work.radius - work.full)
        cx, cy = work.width / 2 - 0.5, work.height / 2 - 0.5
        P = (self.x - cx) * rcp_f * view_z, (cy - self.y) * rcp_f * view_z, -view_z
        rcp_p = -1 / torch.sqrt(P[0] * P[0] + P[1] * P[1] + view_z * view_z)
        V = tuple(c * rcp_p for c in P)
        nV = N[0] * V[0] + N[1] * V[1] + N[2] * V[2]
        # Samples snap to texels, so that where they lie has no derivative.
        reach = (work.radius * work.focal_px / view_z.detach()).clamp(max=work.max_radius_px)
        total = 0
        for dx, dy in zip(*self.directions, strict=True):
            dV = dx * V[0] - dy * V[1]
            nT = (dx * N[0] - dy * N[1] - dV * nV) / torch.sqrt(1 - dV * dV)
            tangent = nT / torch.sqrt(nT * nT + nV * nV)
            k, q = [], []
            for side, start in ((-1, tangent), (1, -tangent)):
                best = start
                for j in range(work.n_steps):
                    t = (self.jitter + j) * (1 / work.n_steps)
                    d = (t * t * reach + 1) * side
                    tx, ty, zs = self._fetch(view_z, self.x + dx * d, self.y + dy * d)
                    D = (tx - cx) * rcp_f * zs - P[0], (cy - ty) * rcp_f * zs - P[1], view_z - zs
                    distance = torch.sqrt(D[0] * D[0] + D[1] * D[1] + D[2] * D[2] + TINY)
                    c = (D[0] * V[0] + D[1] * V[1] + D[2] * V[2]) / distance
                    w = (distance * scale + offset).clamp(0, 1)
                    best = torch.maximum(best, start + w * (c - start))
                c = best.clamp(max=BELOW_ONE)
                q.append(1 - c * c)
                k.append(torch.acos(c) - c * torch.sqrt(q[-1]))
            total = total + 0.5 * (nV * (q[0] + q[1]) + nT * (k[1] - k[0]))
        return total * (1 / work.n_slices)

    def _fetch(self, view_z, x, y):
        """The nearest texel's coordinates and depth."""
        tx, ty = torch.round(x), torch.round(y)
        ix, iy = tx.clamp(0, self.work.width - 1), ty.clamp(0, self.work.height - 1)
        z = view_z[(iy * self.work.width + ix).long()]
        return (ix, iy, z) if self.held else (tx, ty, z)
