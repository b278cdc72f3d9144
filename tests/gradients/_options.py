"""Every continuous option of a configuration, in configurations where it has a derivative and where it has none."""

import gtao  # isort: skip
from gradients._methods import ao, hbao


def linear(start=0.3, end=1.1, **options):
    return gtao.LinearFalloff(start=start, end=end, **options)


def levels(**options):
    return gtao.DepthPyramid(n_levels=3, **({"level_offset": 0.5} | options))


#: name: (configuration from keyword arguments, their values). An argument is called like the option that it is, with
#: the class in front where that is not the method itself.
VERIFIED = {
    "sphere": (
        lambda **o: ao(small_radius_fade=True, **o),
        {"radius": 0.9, "length_blend": 0.3, "depth_bias": 0.02, "power": 1.7, "floor": 0.5, "ceiling": 1.02},
    ),
    "sphere, uniform": (
        lambda **o: ao(weighting="uniform", n_slices=3, **o),
        {"radius": 0.6, "radius_multiplier": 1.4, "floor": 0.3},
    ),
    "sphere, linear fetch": (
        lambda **o: ao(fetch="linear", **o),
        {"radius": 0.9, "radius_multiplier": 1.1, "step_exponent": 1.6, "min_step_px": 1.2, "max_radius_px": 5.3},
    ),
    "not snapped, screen, offset law": (
        lambda **o: ao(snap_to_texel=False, slice_measure="screen", step_law="offset", **o),
        {"radius": 0.9, "step_exponent": 1.0, "min_step_px": 1.6},
    ),
    "no cut, bilinear, whole law": (
        lambda **o: ao(falloff=gtao.NoCut(), fetch="bilinear", step_law="whole", **o),
        {"radius": 0.9, "step_exponent": 2.0, "min_step_px": 1.1, "length_blend": 0.4},
    ),
    "nearest of four, least law": (
        lambda **o: ao(fetch="nearest_of_four", step_law="at_least", step_jitter="step", **o),
        {"radius": 1.1, "min_step_px": 1.2},
    ),
    "unlimited, linear fetch": (
        lambda **o: ao(fetch="linear", **o),
        {"max_radius_share": 0.9, "step_exponent": 1.25},
    ),
    "linear falloff": (
        lambda start, end, **o: ao(radius=1.2, falloff=linear(start, end), **o),
        {
            "start": 0.3,
            "end": 1.1,
            "thin_occluder_compensation": 0.7,
            "length_blend": 0.3,
            "depth_bias": 0.02,
        },
    ),
    "linear falloff, linear fetch, nadir": (
        lambda start, end, **o: ao(falloff=linear(start, end, toward="nadir"), fetch="linear", **o),
        {"start": 0.3, "end": 0.85, "radius": 0.9, "radius_multiplier": 0.8},
    ),
    "linear falloff, toward horizon": (
        lambda start, end: ao(radius=1.2, falloff=linear(start, end, toward="horizon")),
        {"start": 0.3, "end": 1.1},
    ),
    "linear falloff, weighted pyramid": (
        lambda start, end: ao(radius=1.2, falloff=linear(start, end), pyramid=levels()),
        {"start": 0.3, "end": 1.1},
    ),
    "sphere, weighted pyramid": (lambda **o: ao(pyramid=levels(level_offset=-1.0), **o), {"radius": 0.4}),
    "quadratic falloff": (
        lambda end, strength: ao(radius=1.2, falloff=gtao.QuadraticFalloff(end=end, strength=strength)),
        {"end": 1.1, "strength": 0.8},
    ),
    "index falloff": (lambda strength: ao(falloff=gtao.IndexFalloff(strength=strength)), {"strength": 0.6}),
    "sample cut, linear fetch": (
        lambda end: ao(radius=1.2, falloff=gtao.SampleCut(end=end), fetch="linear"),
        {"end": 0.9},
    ),
    "running thickness": (
        lambda blend, end, **o: ao(
            radius=1.2, falloff=linear(end=end), thickness=gtao.RunningThickness(blend=blend), **o
        ),
        {"blend": 0.2, "end": 1.1, "depth_bias": 0.02},
    ),
    "soft sphere": (lambda **o: ao(**o), {"radius": 0.9, "soft_horizon": 0.05}),
    "40 steps": (lambda **o: ao(n_slices=1, n_steps=40, **o), {"radius": 0.9}),
    "hbao by horizon": (lambda **o: hbao(attenuation="horizon", **o), {"radius": 1.2, "depth_bias": 0.02}),
    "hbao by sample": (lambda **o: hbao(attenuation="sample", **o), {"radius": 1.2, "depth_bias": 0.02}),
    "hbao, linear fetch": (
        lambda **o: hbao(attenuation="none", fetch="linear", **o),
        {"radius": 1.2, "step_exponent": 1.0, "radius_multiplier": 1.1},
    ),
}
#: Which fields the arguments of a name stand for, where these are not the method's own.
FIELDS = {
    "linear falloff": {"start": "LinearFalloff.start", "end": "LinearFalloff.end"},
    "quadratic falloff": {"end": "QuadraticFalloff.end", "strength": "QuadraticFalloff.strength"},
    "index falloff": {"strength": "IndexFalloff.strength"},
    "sample cut, linear fetch": {"end": "SampleCut.end"},
    "running thickness": {"blend": "RunningThickness.blend", "end": "LinearFalloff.end"},
}
ORTHOGRAPHIC = ("sphere", "sphere, linear fetch", "linear falloff")

#: Options at the end of their range, where they are off: there are differences to one side only.
AT_THE_END = {
    "sphere": (lambda **o: ao(radius=0.9, **o), {"length_blend": 0.0, "depth_bias": 0.0, "power": 1.0}),
    "linear falloff": (
        lambda start, **o: ao(radius=1.2, falloff=linear(start), **o),
        {"start": 0.0, "thin_occluder_compensation": 0.0, "length_blend": 0.0},
    ),
    # Read twice, a texel ties with itself as soon as no falloff tells one time from the other.
    "index falloff": (
        lambda strength: ao(falloff=gtao.IndexFalloff(strength=strength), fetch="bilinear"),
        {"strength": 0.0},
    ),
    "running thickness": (
        lambda blend: ao(falloff=gtao.NoCut(), thickness=gtao.RunningThickness(blend=blend)),
        {"blend": 0.0},
    ),
    "ceiling": (lambda **o: ao(radius=0.4, n_slices=1, **o), {"ceiling": 1.0}),
}

#: Options in configurations where they only decide whether a sample counts, or which texel it is.
REFUSED = {
    "radius": (0.9, lambda v: ao(radius=v, falloff=gtao.NoCut())),
    "radius, falloff": (0.9, lambda v: ao(radius=v, falloff=linear(end=0.8))),
    "radius, hbao": (1.2, lambda v: hbao(radius=v, attenuation="none")),
    "radius_multiplier": (1.4, lambda v: ao(radius=0.9, radius_multiplier=v, falloff=linear(end=0.8))),
    "step_exponent": (1.6, lambda v: ao(step_exponent=v)),
    "step_exponent, floor": (1.6, lambda v: ao(step_exponent=v, fetch="floor")),
    "step_exponent, chain": (1.6, lambda v: hbao(step_exponent=v)),
    "min_step_px": (1.2, lambda v: ao(min_step_px=v)),
    "max_radius_px": (5.3, lambda v: ao(max_radius_px=v)),
    "max_radius_share": (0.4, lambda v: ao(max_radius_share=v)),
    "SampleCut.end": (0.9, lambda v: ao(radius=1.2, falloff=gtao.SampleCut(end=v))),
    "DepthCut.depth": (
        0.4,
        lambda v: ao(radius=0.9, falloff=linear(end=0.8), thickness=gtao.DepthCut(depth=v), fetch="linear"),
    ),
    "DepthPyramid.level_offset": (
        0.5,
        lambda v: ao(pyramid=gtao.DepthPyramid(filter="min", n_levels=3, level_offset=v)),
    ),
}
