"""Why single deviations can bring an estimate nearer the height field than the faithful method with as few samples."""

__all__ = ["reason"]

_MISSED = "few samples miss occluders and err on the bright side, which"

_REASONS = {
    "border": "texels of the border, repeated outside of it, stand in for what the frame cuts off",
    "ceiling": "values above 1, which average out over pixels, are cut off in each of them",
    "depth_bias": "it takes the rounding of depth out of the first samples",
    "falloff": f"{_MISSED} counting occluders beyond the radius makes up for",
    "fetch": "it reads other texels near edges",
    "floor": "it lifts what is darkest",
    "length_blend": "it brightens tilted surfaces, which sparse slices scatter most",
    "max_radius_px": "samples lie nearer together on a shorter search",
    "max_radius_share": "samples lie nearer together on a shorter search",
    "min_step_px": "its first samples lie elsewhere",
    "power": f"{_MISSED} a power above 1 darkens away",
    "pyramid": "a coarse level holds what lies between samples, so that fewer occluders are missed",
    "radius_multiplier": "its samples lie elsewhere on the search",
    "sector_rounding": f"{_MISSED} closing more than a sample covers makes up for",
    "slice_angles": "its slices lie elsewhere",
    "slice_measure": "slices even in the image happen to meet more of what is there",
    "snap_to_texel": "samples beside the surface see a flat texel nearer to the viewer",
    "step_exponent": "other distances of samples meet the occluders of this scene more often",
    "step_jitter": "other distances of samples meet the occluders of this scene more often",
    "step_law": "other distances of samples meet the occluders of this scene more often",
    "thickness": "it changes which arcs a sample blocks",
    "weighting": "it weighs directions otherwise, which happens to undo another error here",
}


def reason(option: str) -> str:
    """A clause that says why the option can help."""
    return _REASONS.get(option, "it changes where samples lie or what they count")
