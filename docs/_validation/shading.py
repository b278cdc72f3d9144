"""Shading beside a path tracer, from ``references/shading``."""

from .markdown import table

WHOLE = ("direct", "with bounces")
PARTS = ("specular part of metals", "specular part of coats")


def ranked(errors):
    """Names, the largest error first; a record sorts them by name."""
    return sorted(errors, key=errors.__getitem__, reverse=True)


def section(record):
    """Errors of whole images, and of their specular parts, and what they rest on."""
    numbers, config = record["numbers"], record["config"]
    images, parts = (
        [[name, *(f"{numbers[column][name]:.2f}" for column in columns)] for name in ranked(numbers[columns[0]])]
        for columns in (WHOLE, PARTS)
    )
    origin = (
        f"RMS differences over the mean of the truth, {config['width']}x{config['height']} pixels,"
        f" {config['n_slices']} slices of {config['n_steps']} steps per side. From `references/shading/record.json`"
        " (`python references/shading/run.py`)."
    )
    return (
        f"{table(['occlusion of the image', 'straight light', 'with bounces'], images)}\n\n"
        f"{table(['occlusion of the specular part, straight light', 'metals', 'coats'], parts)}\n\n{origin}\n"
    )
