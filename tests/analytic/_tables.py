"""Numbers that both the tests and the documentation show: ``python tests/analytic/_tables.py`` prints them.

Every function returns plain data; :func:`main` writes Markdown tables to standard output.
"""

import sys
from itertools import product
from pathlib import Path

import numpy as np

import gtao  # noqa: F401  (before anything that imports Dr.Jit)

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from analytic._frames import frame, occlusion
from oracles import closed_forms, fields, heightfield, slice_oracle

TILTS = (0, 20, 40, 60, 80)
AZIMUTHS = (10, 100, 145, 250)
#: Window centres in a field of view of 100 degrees: horizontal and vertical angle off the axis, degrees.
PLACES = ((0, 0), (50, 0), (0, -35), (50, 50), (-40, 20))

OPEN_PLANE = {
    "exact": {"fetch": "linear"},
    "nearest, snapped": {"fetch": "nearest", "snap_to_texel": True},
    "nearest": {"fetch": "nearest", "snap_to_texel": False},
    "published measure": {"fetch": "linear", "slice_measure": "screen"},
    "uniform": {"fetch": "linear", "weighting": "uniform"},
}


def open_planes(tilt):
    """The windows onto planes of one tilt (degrees), at every place and azimuth."""
    for place, azimuth in product(PLACES, AZIMUTHS):
        yield fields.tilted_plane(np.radians(tilt), np.radians(azimuth), np.radians(place))


def open_plane(tilt, **options) -> np.ndarray:
    """Mean visibility of every window of :func:`open_planes` at 16 slices; it should be 1."""
    options = {"n_slices": 16, "n_steps": 16} | options
    return np.array([occlusion(field, **options).mean() for field in open_planes(tilt)])


def open_plane_published(tilt) -> np.ndarray:
    """What the published measure must return for the same windows, by quadrature."""
    return np.array([slice_oracle.published_open_mean(f.normal_v, f.view_dirs()).mean() for f in open_planes(tilt)])


def normal_errors(field, dtype=np.float64) -> np.ndarray:
    """Angle in radians between the normals that gtao derives from the depth and the true ones, per pixel."""
    got = frame(field, dtype, normals=False).normal_v.numpy()
    return 2 * np.arcsin(np.clip(np.linalg.norm(got - field.normal_v, axis=-1) / 2, 0, 1))


#: Fields whose derived normals are compared with the true ones.
NORMALS = {
    "plane, 60° tilt, perspective": lambda: fields.tilted_plane(np.radians(60), 1.0, (0.5, -0.4)),
    "trench": lambda: fields.walls(0.5, 1.0, 1.0, 1.5, n_px=60, pixel=0.05, length_px=20),
    "groove": lambda: fields.groove(0.8, 1.2, n_px=60, pixel=0.05, length_px=20),
    "bowl": lambda: fields.bowl(1.0, 0.8, n_px=64, pixel=2.2 / 64),
    "waves, 64 pixels": lambda: fields.in_perspective(fields.waves(0.2, 3.0), size=64),
    "waves, 256 pixels": lambda: fields.in_perspective(fields.waves(0.2, 3.0), size=256),
}


#: Fields for the comparison with ray marching, smooth enough that interpolation defines one surface.
MARCHED = {
    "bumps from above": lambda: fields.from_above(fields.gaussians(0.5, 0.2), size=32),
    "bumps, tilted, perspective": lambda: fields.in_perspective(
        fields.gaussians(0.3, 0.2, seed=4), size=32, slope=(0.3, -0.2)
    ),
    "waves, stretched pixels, off-centre": lambda: fields.in_perspective(
        fields.waves(0.25, 6.0), size=32, tan_half=0.8, stretch=1.25, shift_px=(6.0, -9.0)
    ),
    "waves from above": lambda: fields.from_above(fields.waves(0.3, 5.0), size=32),
    # Walls seen at a grazing angle: half of their hemisphere lies behind the opposite wall, out of a radius' reach.
    "steep groove from above": lambda: fields.groove(0.8, 3.2, n_px=40, pixel=0.05, length_px=40),
}

DENSE = {"fetch": "linear", "n_slices": 32, "n_steps": 128, "step_exponent": 1.0}


def against_marching(name, radius=np.inf, *, n_pixels=200, n_rays=2304, weighting="cosine", **options):
    """RMSE, bias and the oracle's own root mean square standard error on random pixels of a field."""
    field = MARCHED[name]()
    pixels = np.random.default_rng(5).integers(0, field.view_z.shape[0], (n_pixels, 2))
    truth = heightfield.visibility(field, pixels, n_rays=n_rays, radius=radius, weighting=weighting, seed=6)
    got = occlusion(field, radius=radius, weighting=weighting, **(DENSE | options))
    error = got[pixels[:, 0], pixels[:, 1]] - truth.visibility
    return {
        "rmse": float(np.sqrt(np.mean(error**2))),
        "bias": float(error.mean()),
        "oracle": float(np.sqrt(np.mean(truth.standard_error**2))),
        "mean": float(truth.visibility.mean()),
    }


def trench(n_steps, pixel=0.05, **options):
    """Floor of a trench (walls 0.5 and 1 away from its zero, heights 1 and 1.5): distances and visibility.

    Returns ``(d_left, d_right, visibility)`` of the floor pixels of the middle row, walls excluded.
    """
    n_px = round(3.0 / pixel)
    field = fields.walls(0.5, 1.0, 1.0, 1.5, n_px=n_px, pixel=pixel, length_px=round(20 / pixel))
    x = field.plane_coordinates()[0][0]
    floor = (x > -0.5) & (x < 1.0)
    options = {"n_slices": 64, "noise": "none", "step_exponent": 1.0, "snap_to_texel": False} | options
    image = occlusion(field, n_steps=n_steps, **options)
    return x[floor] + 0.5, 1.0 - x[floor], image[len(image) // 2, floor]


def trench_errors(steps=(32, 64, 128, 256)) -> list[float]:
    """Mean error on the trench's floor, two pixels and more from the walls, for numbers of steps."""
    errors = []
    for n_steps in steps:
        left, right, got = trench(n_steps)
        away = np.minimum(left, right) > 0.1
        errors.append(float(np.mean((got - closed_forms.walls(left, right, 1.0, 1.5))[away])))
    return errors


def bowl(n_px, *, sphere_radius=1.0, depth=0.8, **options):
    """Visibility of the pixels of a spherical bowl that lie within 90 % of its rim."""
    field = fields.bowl(sphere_radius, depth, n_px=n_px, pixel=2.2 * sphere_radius / n_px)
    rim = np.sqrt(sphere_radius**2 - (sphere_radius - depth) ** 2)
    inside = np.hypot(*field.plane_coordinates()) < 0.9 * rim
    options = {"n_slices": 32, "n_steps": 8 * n_px, "fetch": "linear", "noise": "none", "step_exponent": 1.0} | options
    return occlusion(field, **options)[inside]


def bowl_errors(sizes=(24, 48, 96)) -> list[float]:
    """Mean error in the bowl for image sizes, the steps dense enough not to matter."""
    return [float(bowl(n).mean() - closed_forms.bowl(1.0, 0.8)) for n in sizes]


def sphere(n_steps, *, centre=(0.3, -0.2, -0.4), size=32, **options) -> np.ndarray:
    """Visibility on the inner wall of a unit sphere seen from off its centre, exactly constant in truth."""
    field = fields.inside_sphere(1.0, centre, size=size)
    options = {"n_slices": 32, "fetch": "linear", "noise": "none", "step_exponent": 1.0} | options
    return occlusion(field, n_steps=n_steps, **options)


def sphere_errors(steps=(16, 32, 64, 128)) -> list[float]:
    """Mean error inside the sphere for numbers of steps."""
    exact = closed_forms.inside_sphere(1.0, (0.3, -0.2, -0.4), 1.0)
    return [float(sphere(n).mean() - exact) for n in steps]


def orders(errors) -> np.ndarray:
    """Observed order of convergence between successive halvings."""
    errors = np.abs(errors)
    return np.log2(errors[:-1] / errors[1:])


def _table(title, header, rows) -> None:
    print(f"\n{title}\n\n| {' | '.join(header)} |\n|{' --- |' * len(header)}")
    for row in rows:
        print(f"| {' | '.join(v if isinstance(v, str) else f'{v:.4f}' for v in row)} |")


def main() -> None:
    """Write every table."""
    rows = []
    for tilt in TILTS:
        row = [f"{tilt}°"]
        for options in OPEN_PLANE.values():
            values = open_plane(tilt, **options)
            row.append(f"{values.min():.4f} .. {values.max():.4f}")
        predicted = open_plane_published(tilt)
        rows.append([*row, f"{predicted.min():.4f} .. {predicted.max():.4f}"])
    _table(
        "Mean visibility of an open plane, 16 slices, windows over a 100° field of view (exact value 1)",
        ["tilt", *OPEN_PLANE, "published measure, by quadrature"],
        rows,
    )
    rows = []
    for name, make in NORMALS.items():
        values = np.degrees(normal_errors(make(), np.float32))
        rows.append([name, values.mean(), np.quantile(values, 0.95), values.max()])
    _table("Normals derived from float32 depth against true ones, degrees", ["field", "mean", "95 %", "largest"], rows)
    rows = []
    for name, radius in product(MARCHED, (np.inf, 0.5)):
        r = against_marching(name, radius)
        rows.append([name, f"{radius:g}", r["mean"], r["rmse"], r["bias"], r["oracle"]])
    _table(
        "GTAO (32 slices, 128 steps, linear fetch) against ray marching of the same height field",
        ["field", "radius", "mean visibility", "RMSE", "bias", "standard error of the oracle"],
        rows,
    )
    for title, parameter, values, errors in (
        ("Trench floor, nearest fetch", "steps", (32, 64, 128, 256), trench_errors()),
        ("Spherical bowl, linear fetch", "pixels", (24, 48, 96), bowl_errors()),
        ("Inside of a sphere, perspective, linear fetch", "steps", (16, 32, 64, 128), sphere_errors()),
    ):
        observed = ["", *(f"{o:.2f}" for o in orders(errors))]
        _table(
            f"{title}: mean error and observed order",
            [parameter, "error", "order"],
            [[str(v), e, o] for v, e, o in zip(values, errors, observed, strict=True)],
        )


if __name__ == "__main__":
    main()
