"""The stock ``path`` integrator, started at pixel centres: the independent estimate of multi-bounce light."""

import drjit as dr
import mitsuba as mi
import numpy as np


def set_reflectance(scene, value):
    parameters = mi.traverse(scene)
    for name in list(parameters.keys()):
        if name.endswith("reflectance.value"):
            parameters[name] = mi.Color3f(value)
    parameters.update()


def reflected(scene, rho, n_bounces, spp, n_batches, seed, sensor=0):
    """(n_batches, H, W) light that arrives after up to ``n_bounces`` surfaces, divided by the albedo ``rho``.

    Radiance of the dome is 1, so a pixel that sees it reads 1 / rho.
    """
    set_reflectance(scene, rho)
    return radiance(scene, n_bounces, spp, n_batches, seed, sensor)[..., 0] / np.float32(rho)


def radiance(scene, n_bounces, spp, n_batches, seed, sensor=0):
    """(n_batches, H, W, 3) light that arrives after up to ``n_bounces`` surfaces."""
    sensor = scene.sensors()[sensor]
    integrator = mi.load_dict({"type": "path", "max_depth": n_bounces + 1, "rr_depth": 1000})
    width, height = (int(v) for v in sensor.film().crop_size())
    n_rays = spp // n_batches
    images = []
    for batch in range(n_batches):
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed * n_batches + batch, width * height * n_rays)
        pixel = dr.arange(mi.UInt32, width * height * n_rays) // n_rays
        y = pixel // width
        x = pixel - y * width
        film = mi.Point2f((mi.Float(x) + 0.5) / width, (mi.Float(y) + 0.5) / height)
        ray, _ = sensor.sample_ray_differential(0.0, 0.5, film, mi.Point2f(0.5))
        light, _, _ = integrator.sample(scene, sampler, ray)
        means = [dr.block_sum(channel, n_rays).numpy() / n_rays for channel in light]
        images.append(np.stack(means, -1).reshape(height, width, 3))
    return np.stack(images)
