"""Fields, thickness models and the comparison with arcs found point by point that tests of the bitmask share."""

import numpy as np
from analytic._frames import image, pixels
from oracles import bitmask_oracle, fields

import gtao

FIELDS = {
    "from above": lambda: fields.from_above(fields.gaussians(0.35, 0.2, count=12, seed=4), size=32),
    "stretched, off-centre": lambda: fields.in_perspective(
        fields.gaussians(0.25, 0.12, count=14, seed=1), size=32, stretch=1.3, slope=(0.3, -0.2), shift_px=(5.0, -3.0)
    ),
}
# Both sides are float64 and agree to 1e-12; a sector whose middle lies that close to the end of an arc is not met.
ROUNDING = 1e-9


def along_eye_rays(field, length):
    """Bodies that reach ``length`` times a function of depth along the eye ray behind the surface."""
    x, y = field.plane_coordinates()
    stretch = np.ones_like(x) if field.orthographic else np.sqrt(x * x + y * y + 1)

    def bodies(row, column):
        z = field.view_z[row, column]
        return [(z, z + length(z, stretch[row, column]))]

    return bodies


THICKNESSES = {
    "solid": (None, lambda z, stretch: np.inf),
    "constant": (gtao.ConstantThickness(thickness=0.15), lambda z, stretch: 0.15 / stretch),
    "linear": (gtao.LinearThickness(slope=0.04), lambda z, stretch: 0.04 * z),
}


def compare(field, options, bodies, layers=None, n_pixels=6, **oracle):
    common = {"radius": 0.6, "n_slices": 3, "n_steps": 7} | options
    falloff = {"sphere": None, "sample": gtao.SampleCut(end=0.6), "none": gtao.NoCut()}[oracle.get("cut", "sphere")]
    method = gtao.VisibilityBitmask(noise="none", falloff=falloff, **common)
    got = image(field, method, layers=layers)
    common = {k: v for k, v in common.items() if k not in ("thickness", "sector_rounding")}
    where = pixels(field, n_pixels)
    want = np.array([bitmask_oracle.visibility(field, *pixel, bodies=bodies, **common, **oracle) for pixel in where])
    return got[where[:, 0], where[:, 1]], want
