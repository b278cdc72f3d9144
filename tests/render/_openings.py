"""A speck of surface that sees the sky through a round opening."""

import math

import _scenes as S
import numpy as np
from oracles import glossy

#: Sides of the opening's rim: inscribed, it loses (π / n)² / 6 of its radius on average, 2.5e-5.
N_RIM = 256
PATCH = 1e-3


def shell(theta_o, b, alpha_v, size=16, cap=False):
    """A speck at the origin with normal z, inside a sphere that is open within ``alpha_v`` of ``b``.

    With ``cap`` there is but the piece that would close it.
    """
    vertices, faces = S.sphere_grid(64, N_RIM, math.pi - alpha_v if cap else alpha_v)
    if cap:
        vertices = vertices * [1, 1, -1]
    across = np.cross(b, [1.0, 0, 0] if abs(b[0]) < 0.7 else [0, 1.0, 0])
    across /= np.linalg.norm(across)
    turned = vertices @ np.stack([across, np.cross(b, across), b])
    v = glossy.frame(theta_o, 0, 0)[0]
    # Half of the speck's height as it appears fills the image: all pixels look at nearly one point.
    fov = 2 * math.degrees(math.atan(0.5 * PATCH * math.cos(theta_o) / 0.5))
    sensor = S.perspective(v / 2, (0, 0, 0), up=(0, 1, 0), fov=fov, size=(size, size), near=1e-3)
    speck = S.rectangle(S.transform().scale([PATCH, PATCH, 1]))
    return S.scene(sensor, speck=speck, shell=S.mesh(turned, faces, name="shell"))
