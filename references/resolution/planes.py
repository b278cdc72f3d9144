"""What open planes read from smaller frames: 1, or as much less as the frame occludes itself."""

from itertools import product

import numpy as np

import gtao

TILTS = (0, 20, 40, 60, 75)
SIZE, FOCAL = 96, 400.0
#: Rows and columns of the small frame that look beyond it.
BORDER = 4


def plane(tilt):
    """A plane through the optical axis, tilted about a direction that is not the pixels'."""
    camera = gtao.PerspectiveCamera(SIZE, SIZE, fx=FOCAL)
    x, y = (np.arange(SIZE) + 0.5 - SIZE / 2) / FOCAL, -(np.arange(SIZE) + 0.5 - SIZE / 2) / FOCAL
    n = np.array([np.sin(tilt) * np.cos(0.7), np.sin(tilt) * np.sin(0.7), np.cos(tilt)])
    z = 3 * n[2] / (n[2] - n[0] * x[None, :] - n[1] * y[:, None])
    return gtao.GBuffer(z, np.broadcast_to(n, (SIZE, SIZE, 3)).copy(), camera)


def measured(quick):
    """Tilt in degrees -> factor -> choice and place -> mean visibility; "full" of the frame itself."""
    # Reading depths by linear interpolation is exact on planes: what is missing is the small frame's doing.
    method = gtao.GTAO(radius=0.1, n_slices=4 if quick else 32, n_steps=8, fetch="linear")
    found = {}
    for tilt in TILTS:
        g = plane(np.radians(tilt))

        def mean(frame, border):
            inner = (slice(border, -border),) * 2
            return float(gtao.ambient_occlusion(frame, method).visibility.numpy()[inner].mean())

        entry = {"full": mean(g, 4 * BORDER)}
        for factor in (2, 4):
            entry[str(factor)] = {
                f"{choice}, {place}": mean(
                    gtao.downsample(g, gtao.Downsample(factor=factor, choice=choice, place=place)), BORDER
                )
                for choice, place in product(("nearest", "farthest", "checkerboard", "first"), ("texel", "centre"))
            }
        found[str(tilt)] = entry
    return found
