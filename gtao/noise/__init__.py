"""Noise and its laboratory."""

from .void_and_cluster import blue_noise_mask, void_and_cluster

__all__ = ["blue_noise_mask", "void_and_cluster"]
