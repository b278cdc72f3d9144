"""A sphere above a tilted floor under an empty sky, ray traced in closed form, and EXR files made of it."""

import numpy as np
import OpenEXR

import gtao

WIDTH, HEIGHT, FOCAL = 24, 20, 18.0
#: A camera pose: rotation from world to view frame, with no axis left in place.
TO_VIEW = np.linalg.qr(np.array([[0.3, -1.2, 0.5], [0.9, 0.4, -0.7], [0.2, 0.8, 1.1]]))[0]
TO_VIEW *= np.sign(np.linalg.det(TO_VIEW))


def camera(near=0.0):
    return gtao.PerspectiveCamera(WIDTH, HEIGHT, fx=FOCAL, cx=11.0, cy=10.5, near=near)


def trace():
    """``(view_z, ray_t, normal_v)`` in float64; view_z and ray_t are infinite and the normal 0 on the sky."""
    y, x = np.indices((HEIGHT, WIDTH)) + 0.5
    d = np.stack([(x - 11.0) / FOCAL, (10.5 - y) / FOCAL, -np.ones_like(x)], -1)
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    t = np.full(x.shape, np.inf)
    n = np.zeros((*x.shape, 3))

    up = np.array([0.2, 1.0, 0.3]) / np.linalg.norm([0.2, 1.0, 0.3])
    cosine = d @ up
    floor = np.where(cosine < -1e-3, -1.0 / np.where(cosine < -1e-3, cosine, 1), np.inf)
    hit = floor < 8
    t[hit], n[hit] = floor[hit], up

    centre, radius = np.array([0.3, 0.1, -4.0]), 1.2
    b = d @ centre
    root = b * b - (centre @ centre - radius**2)
    near = np.where(root > 0, b - np.sqrt(np.maximum(root, 0)), np.inf)
    hit = near < t
    t[hit] = near[hit]
    n[hit] = (d[hit] * near[hit, None] - centre) / radius
    return t * -d[..., 2], t, n


def depth_and_normals(background=np.inf):
    """float32 ``(view_z, normal_v)`` with the given value on the sky."""
    z, _, n = trace()
    return np.where(np.isfinite(z), z, background).astype(np.float32), n.astype(np.float32)


def vector(name, values, components="XYZ"):
    return {f"{name}.{c}": np.ascontiguousarray(values[..., i]) for i, c in enumerate(components)}


def write_exr(path, channels, header=None):
    """One part. The binding replaces the arrays in the dict that it is given, hence the copy."""
    head = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | (header or {})
    OpenEXR.File(head, dict(channels)).write(str(path))
    return path


def write_parts(path, parts, header=None):
    """``parts``: part name -> channels."""
    head = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | (header or {})
    OpenEXR.File([OpenEXR.Part(dict(head), dict(c), name) for name, c in parts.items()]).write(str(path))
    return path
