"""Directions: bent normals and spherical harmonics over the visibility alone, and their gradients.

python -m tests.bench.directions [--quick]
"""

import drjit as dr

import gtao

from .harness import package
from .harness.clock import compare
from .harness.options import run_section
from .harness.table import HEAD, ratio_rows
from .harness.work import COUNTS, FRAME_INDEX, Work, frame

ALONE, BENT, HARMONICS = "visibility", "bent normals", "spherical harmonics"
OPTIONS = {BENT: {"bent_normal": True}, HARMONICS: {"directional": True}}


def methods(work):
    """Name -> configuration without directions."""
    counts = {"radius": work.radius, "n_slices": work.n_slices, "n_steps": work.n_steps}
    return {
        "linear falloff": work.method(),
        "exact cut": gtao.GTAO(**counts, max_radius_px=work.max_radius_px),
        "linear falloff, uniform": work.method(weighting="uniform"),
    }


def variants(g, method):
    """Name -> callable: the visibility, and each kind of directions in planes and as a tensor."""
    runs = {ALONE: package.estimate(g, method)}
    for name, more in OPTIONS.items():
        directed = gtao.method_from_dict(method.to_dict() | more)
        runs[name] = package.directions(g, directed)
        runs[f"{name}, tensor"] = package.directions(g, directed, tensors=True)
    return runs


def gradients(g, method):
    """Name -> callable: an estimate and the gradients of the same loss of every plane that it gives."""

    def step(directed):
        view_z, normal_v = (type(t)(t) for t in (g.view_z, g.normal_v))
        dr.enable_grad(view_z, normal_v)
        attached = gtao.GBuffer(view_z, normal_v, g.camera, validate=False)
        ao = gtao.ambient_occlusion(attached, directed, frame_index=FRAME_INDEX)
        planes = [ao.visibility.array]
        if directed.directional or directed.bent_normal:
            planes += ao.planes("visibility_sh" if directed.directional else "mean_direction").arrays
        dr.backward(sum(dr.mean(dr.square(plane - 0.5)) for plane in planes))
        dr.eval(dr.grad(view_z), dr.grad(normal_v))

    configurations = {ALONE: method} | {
        name: gtao.method_from_dict(method.to_dict() | more) for name, more in OPTIONS.items()
    }
    return {name: lambda m=m: step(m) for name, m in configurations.items()}


def measure(options):
    size, entries = "540p" if options.quick else "1080p", []
    for counts in ("1x8", "9x3"):
        work = Work.of(size, COUNTS[counts])
        g = frame(work).gbuffer(work)
        for name, method in methods(work).items():
            rows = compare(variants(g, method), ALONE, options)
            entries.append({"size": size, "counts": counts, "method": name, "rows": rows})
        rows = compare(gradients(g, work.method()), ALONE, options)
        entries.append({"size": size, "counts": counts, "method": "with gradients", "rows": rows})
    return {"entries": entries}


def tables(numbers):
    for entry in numbers["entries"]:
        yield f"{entry['size']}, {entry['counts']}: {entry['method']}", HEAD, ratio_rows(entry["rows"])


if __name__ == "__main__":
    run_section(measure, tables, __doc__)
