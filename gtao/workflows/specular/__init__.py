"""Occlusion of glossy reflections against ray-traced truth: what the comparison and the fit of apertures share."""
