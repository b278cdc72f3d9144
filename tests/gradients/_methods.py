"""Configurations that between them take every path through the estimator that has a derivative."""

import gtao

SMALL = {"n_slices": 2, "n_steps": 4}
LINEAR = {"radius": 1.2, "falloff": gtao.LinearFalloff(start=0.3, end=1.1)}


def ao(**options):
    return gtao.GTAO(**(SMALL | options))


def hbao(**options):
    return gtao.HBAO(**({"n_directions": 4, "n_steps": 4, "radius": 1.2} | options))


def toward(which, **options):
    return ao(radius=1.2, falloff=gtao.LinearFalloff(start=0.3, end=1.1, toward=which), **options)


def pyramid(name, **options):
    levels = gtao.DepthPyramid(filter=name, n_levels=3, level_offset=0.5)
    return ao(pyramid=levels, radius=1.2, falloff=gtao.LinearFalloff(start=0.3, end=1.1), **options)


#: Methods whose horizon is a maximum of samples. Options that do not meddle with each other share a configuration.
MAXIMA = {
    "unlimited": ao(),
    "nine slices, one step, uniform": ao(weighting="uniform", n_slices=9, n_steps=1),
    "sphere": ao(radius=0.9),
    "sphere uniform": ao(radius=0.9, weighting="uniform", n_slices=3),
    "linear falloff": ao(**LINEAR),
    "linear falloff toward nadir": toward("nadir", thin_occluder_compensation=0.7, length_blend=0.3),
    "quadratic falloff": ao(radius=1.2, falloff=gtao.QuadraticFalloff(end=1.1, strength=0.8), fetch="nearest_of_four"),
    "sample cut": ao(radius=1.2, falloff=gtao.SampleCut(end=0.9), step_law="offset", border="replicate"),
    "depth cut, screen, not normalised": ao(
        **LINEAR,
        thickness=gtao.DepthCut(depth=0.4),
        slice_measure="screen_unnormalised",
        noise="white",
        seed=3,
    ),
    "no cut, optical axis": ao(radius=0.9, falloff=gtao.NoCut(), zenith="optical_axis", weighting="uniform"),
    "shaped and pulled": ao(
        radius=0.9, power=1.7, floor=0.2, ceiling=1.1, small_radius_fade=True, depth_bias=0.02, max_radius_share=0.3
    ),
    "two-term arc cosine": ao(**LINEAR, arccosine="two_term", horizon_start="tangent"),
    "screen": ao(radius=0.9, slice_measure="screen", noise="none", step_jitter="step"),
    "listed angles, beyond law": ao(
        radius=0.9,
        slice_angles=(0.1, 0.45),
        step_jitter="pixel",
        noise="interleaved_gradient",
        step_law="beyond",
        max_radius_px=6.0,
        radius_multiplier=1.3,
    ),
    "linear fetch": ao(radius=0.9, fetch="linear", step_law="whole"),
    "linear fetch, step power": ao(fetch="linear", step_exponent=1.6, noise="interleaved_gradient_cycled"),
    "bilinear fetch": ao(**LINEAR, fetch="bilinear", step_exponent=2.0),
    "floor": ao(radius=0.9, fetch="floor", noise="hilbert_r2"),
    "not snapped": ao(radius=0.9, snap_to_texel=False, step_exponent=1.0),
    "least law, clamped": ao(**LINEAR, step_law="at_least", border="clamp", step_jitter="none"),
    "one slice, 32 steps": ao(radius=0.9, n_slices=1, n_steps=32),
    "40 steps": ao(**LINEAR, n_slices=1, n_steps=40),
    "pyramid of minima": pyramid("min"),
    "weighted pyramid": pyramid("weighted"),
    "averaged pyramid, bilinear": pyramid("average", fetch="bilinear"),
    "hbao": hbao(attenuation="horizon"),
    "hbao without attenuation": hbao(attenuation="none", zenith="view", slice_measure="view", fetch="linear"),
}

#: Methods whose result depends on every sample.
CHAINS = {
    "linear falloff toward horizon": toward("horizon"),
    "index falloff": ao(falloff=gtao.IndexFalloff(strength=0.8)),
    "running thickness": ao(**LINEAR, thickness=gtao.RunningThickness(blend=0.2)),
    "running toward horizon": toward("horizon", thickness=gtao.RunningThickness(blend=0.2), horizon_start="tangent"),
    "hbao by sample": hbao(attenuation="sample", n_directions=10),
    "soft sphere": ao(radius=0.9, soft_horizon=0.05),
    "soft linear falloff": ao(**LINEAR, soft_horizon=0.1, weighting="uniform", fetch="linear"),
}
METHODS = MAXIMA | CHAINS
ORTHOGRAPHIC = ("sphere", "linear falloff", "screen", "linear fetch", "not snapped", "running thickness")
CASES = [(name, "perspective") for name in METHODS] + [(name, "orthographic") for name in ORTHOGRAPHIC]
IDS = [f"{name}, {kind}" if kind == "orthographic" else name for name, kind in CASES]
