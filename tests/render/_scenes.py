"""Small scenes with known answers, built here and not taken from the package."""

import mitsuba as mi
import numpy as np

WHITE_DOME = {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}}


def transform():
    return mi.ScalarTransform4f()


def look_at(origin, target, up=(0, 0, 1)):
    return transform().look_at(origin=list(origin), target=list(target), up=list(up))


def film(width=32, height=32, **extra):
    return {
        "type": "hdrfilm",
        "width": width,
        "height": height,
        "component_format": "float32",
        "rfilter": {"type": "box"},
        **extra,
    }


def perspective(origin, target, fov=40.0, up=(0, 0, 1), size=(32, 32), near=0.01, **extra):
    return {
        "type": "perspective",
        "fov": fov,
        "near_clip": near,
        "to_world": look_at(origin, target, up),
        "film": film(*size),
        **extra,
    }


def matte(reflectance=0.5):
    return {"type": "twosided", "b": {"type": "diffuse", "reflectance": {"type": "rgb", "value": reflectance}}}


def scene(sensor, **shapes):
    """Scene dict under a white dome."""
    return {"type": "scene", "dome": WHITE_DOME, "sensor": sensor, **shapes}


def rectangle(to_world, reflectance=0.5):
    return {"type": "rectangle", "to_world": to_world, "bsdf": matte(reflectance)}


def cube(low, high, reflectance=0.5):
    low, high = np.asarray(low, float), np.asarray(high, float)
    to_world = transform().translate(list((low + high) / 2)) @ transform().scale(list((high - low) / 2))
    return {"type": "cube", "to_world": to_world, "bsdf": matte(reflectance)}


FAR = 1e4


def plane(sensor):
    """z = 0, wide enough that no ray misses it."""
    return scene(sensor, floor=rectangle(transform().scale([FAR, FAR, 1])))


def groove(angle, sensor, reflectance=0.5):
    """Two half planes that enclose ``angle`` about +z and meet in the y axis.

    Each goes on behind the other, so that nothing leaks through the seam.
    """
    sides = {}
    for name, sign in (("left", -1), ("right", 1)):
        lean = sign * np.degrees(angle) / 2
        sides[name] = rectangle(
            transform().rotate([0, 1, 0], lean)
            @ transform().translate([0, 0, FAR - 1])
            @ transform().rotate([0, 1, 0], 90)
            @ transform().scale([FAR, FAR, 1]),
            reflectance,
        )
    return scene(sensor, **sides)


def closed_box(sensor, reflectance=0.5):
    """Six thick walls about the cube of half-width 1."""
    walls = {}
    for axis in range(3):
        for sign in (-1, 1):
            low, high = np.full(3, -1.5), np.full(3, 1.5)
            low[axis], high[axis] = sorted((sign * 1.0, sign * 1.5))
            walls[f"wall{len(walls)}"] = cube(low, high, reflectance)
    return scene(sensor, **walls)


def cornell(size=32, reflectance=0.5):
    """Mitsuba's box without its lamp, one albedo everywhere."""
    d = mi.cornell_box()
    del d["light"]
    for value in d.values():
        if isinstance(value, dict) and "bsdf" in value:
            value["bsdf"] = matte(reflectance)
    for name in ("white", "red", "green", "integrator"):
        del d[name]
    d["sensor"]["film"] = film(size, size)
    d["dome"] = WHITE_DOME
    return d


def stairs(size=32, reflectance=0.5):
    """Steps of cubes between two side walls: an open scene of faces."""
    steps = {f"step{i}": cube([-2, 0.5 * i, -1], [2, 0.5 * i + 6, 0.4 * (i + 1) - 0.4], reflectance) for i in range(5)}
    sides = {f"side{i}": cube([x - 0.2, -3, -1], [x + 0.2, 8, 2.2], reflectance) for i, x in enumerate((-2, 2))}
    ground = {"ground": cube([-50, -50, -1], [50, 50, 0], reflectance)}
    return scene(perspective((0.5, -5, 3.5), (0, 1, 0.6), size=(size, size)), **ground, **steps, **sides)


def balls(size=32, reflectance=0.5):
    """Spheres on a floor: curved surfaces with their own normals."""
    rng = np.random.default_rng(3)
    shapes = {
        f"ball{i}": {
            "type": "sphere",
            "center": [float(x), float(y), r],
            "radius": r,
            "bsdf": matte(reflectance),
        }
        for i, (x, y, r) in enumerate((*rng.uniform(-1.5, 1.5, 2), float(rng.uniform(0.2, 0.5))) for _ in range(12))
    }
    ground = {"ground": cube([-50, -50, -1], [50, 50, 0], reflectance)}
    return scene(perspective((0, -5, 3), (0, 0, 0.2), size=(size, size)), **ground, **shapes)


def mesh(vertices, faces, normals=None, name="mesh", reflectance=0.5):
    """Mitsuba mesh; without ``normals`` its faces are flat."""
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(matte(reflectance))
    if normals is None:
        properties["face_normals"] = True
    m = mi.Mesh(name, len(vertices), len(faces), properties, has_vertex_normals=normals is not None)
    parameters = mi.traverse(m)
    parameters["vertex_positions"] = np.asarray(vertices, np.float32).ravel()
    parameters["faces"] = np.asarray(faces, np.uint32).ravel()
    if normals is not None:
        parameters["vertex_normals"] = np.asarray(normals, np.float32).ravel()
    parameters.update()
    return m


def sphere_grid(n_theta, n_phi, theta_min=0.0):
    """Vertices of a unit sphere from polar angle ``theta_min`` to π, and the triangles between them."""
    theta = np.linspace(theta_min, np.pi, n_theta + 1)
    phi = np.arange(n_phi) * 2 * np.pi / n_phi
    t, p = np.meshgrid(theta, phi, indexing="ij")
    vertices = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(n_theta), np.arange(n_phi), indexing="ij")
    a, b = i * n_phi + j, i * n_phi + (j + 1) % n_phi
    faces = np.stack([a, a + n_phi, b, b, a + n_phi, b + n_phi], -1).reshape(-1, 3)
    return vertices, faces
