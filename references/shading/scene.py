"""A yard of boxes, balls and a brick wall under a bright sky: textured, glossy, in memory."""

import mitsuba as mi
import numpy as np

import gtao

#: Width of the sensor's field of view, in degrees.
FOV = 42.0


def sky(height=64):
    """A gradient from zenith to ground, and a wide glow around a sun."""
    gradient = gtao.lighting.gradient_sky([0, 0, 1], [0.25, 0.42, 0.9], [0.95, 0.9, 0.8], [0.12, 0.1, 0.08])
    glow = gtao.lighting.von_mises_fisher([-0.7, -0.6, 0.55], 12, [0.5, 0.42, 0.3])
    return gtao.lighting.EnvironmentMap(gradient.map(height).radiance + glow.map(height).radiance)


def yard(environment, width, height, max_depth=2, show="shaded"):
    """A ``mitsuba.Scene``.

    Args:
        environment: light.
        width, height: of the image, in pixels.
        max_depth: of paths; 2 is light straight from the sky.
        show: "shaded": diffuse surfaces under glossy coats. "roughness" or "f0": surfaces that are diffuse and have the
            coat's property for an albedo, so that a G-buffer's albedo is an image of it.
    """
    dome = gtao.render.environment_emitter(environment)  # also sets Mitsuba's variant
    transform = mi.ScalarTransform4f

    def rgb(*value):
        return {"type": "rgb", "value": list(value)}

    def coat(albedo, roughness, f0=(0.04, 0.04, 0.04)):
        if show == "shaded":
            return gtao.render.coated(albedo, roughness, rgb(*f0))
        return {"type": "diffuse", "reflectance": rgb(*f0) if show == "f0" else rgb(roughness, roughness, roughness)}

    def box(low, high, bsdf):
        low, high = np.array(low), np.array(high)
        place = transform().translate(list((low + high) / 2)) @ transform().scale(list((high - low) / 2))
        return {"type": "cube", "to_world": place, "bsdf": bsdf}

    def ball(centre, radius, bsdf):
        return {"type": "sphere", "center": centre, "radius": radius, "bsdf": bsdf}

    tiles = {"type": "checkerboard", "color0": rgb(0.7, 0.66, 0.6), "color1": rgb(0.12, 0.13, 0.16)}
    tiles["to_uv"] = transform().scale([14, 14, 1])
    brick = {"type": "bitmap", "bitmap": mi.Bitmap(bricks()), "raw": True}
    wood, stone = coat(rgb(0.35, 0.22, 0.12), 0.4), coat(rgb(0.6, 0.6, 0.58), 0.6)
    described = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": max_depth},
        "sensor": {
            "type": "perspective",
            "fov": FOV,
            "fov_axis": "x",
            "to_world": transform().look_at([1.9, -5.6, 3.0], [-0.1, 0.3, 0.7], [0, 0, 1]),
            "film": {
                "type": "hdrfilm",
                "width": width,
                "height": height,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
            },
        },
        "dome": dome,
        "floor": {"type": "rectangle", "to_world": transform().scale([7, 7, 1]), "bsdf": coat(tiles, 0.35)},
        "wall": box([-7, 1.6, 0], [7, 1.9, 2.6], coat(brick, 0.7)),
        "shelf": box([-2.4, 0.9, 1.45], [0.4, 1.6, 1.57], wood),
        "post": {"type": "cylinder", "p0": [0.35, 1.15, 0], "p1": [0.35, 1.15, 1.45], "radius": 0.13, "bsdf": wood},
        "red crate": box([-2.2, 0.5, 0], [-1.2, 1.5, 1.0], coat(rgb(0.55, 0.12, 0.1), 0.3)),
        "green crate": box([-1.05, 0.7, 0], [-0.25, 1.5, 0.8], coat(rgb(0.08, 0.4, 0.38), 0.5)),
        "lower step": box([0.9, 0.6, 0], [2.6, 1.6, 0.35], stone),
        "upper step": box([0.9, 1.0, 0.35], [2.6, 1.6, 0.7], stone),
        "gold": ball([-0.9, -0.4, 0.5], 0.5, coat(0.0, 0.25, (0.95, 0.72, 0.38))),
        "copper": ball([1.7, 0.85, 1.02], 0.32, coat(0.0, 0.45, (0.93, 0.55, 0.42))),
        "china": ball([0.35, -0.2, 0.38], 0.38, coat(rgb(0.75, 0.75, 0.72), 0.2)),
    }
    return mi.load_dict(described)


def bricks(size=256):
    """Albedo of a brick wall, (size, size, 3) float32; the first axis is along the wall, as on the face of a box."""
    x, y = np.mgrid[0:size, 0:size] / size
    row = np.floor(14 * y).astype(int)
    along = 24 * x + 0.5 * (row % 2)
    mortar = (along % 1 < 0.06) | (14 * y % 1 < 0.1)
    tone = np.random.default_rng(1).uniform(0.5, 1, (14, 26))[row, np.floor(along).astype(int)]
    colour = np.where(mortar[..., None], [0.55, 0.53, 0.5], tone[..., None] * np.array([0.62, 0.25, 0.16]))
    return colour.astype(np.float32)
