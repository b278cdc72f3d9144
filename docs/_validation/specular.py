"""All methods of specular occlusion against traced reflections, from ``references/specular``."""

from gtao.workflows.specular.composites import LIGHT_ALONE, SPLITS, THREE, TRACED_S, TWO, UNSPLIT
from gtao.workflows.specular.cone_shaped import CLOSURE
from gtao.workflows.specular.methods import DENSE, DENSE_COUNTS, EXACT, GAME, GAME_COUNTS, RECOMMENDED, TRACED

from .markdown import credits, folded, pictures
from .specular_tables import (
    GLASS,
    OURS,
    PLAIN,
    RIVAL,
    TILT,
    WHITE,
    at,
    cones,
    explained,
    factor,
    factors,
    lit,
    lit_by_light,
    matrices,
    mean,
    overview,
    rmse,
    steps,
)

#: The table with every aperture.
APERTURES = (OURS, "brdf-4d-tilted", "brdf-4d-matched", "brdf-4d-published")


def crossing(numbers, name, source):
    """The least roughness from which on a method is no better than visibility itself, in words."""
    worse = [r for r in numbers["order"] if at(numbers, source, name, r) >= at(numbers, source, PLAIN, r)]
    if not worse:
        return f"`{name}` at none"
    last = numbers["order"][numbers["order"].index(worse[0]) :]
    return f"`{name}` {'from' if worse == last else 'at'} {worse[0] if worse == last else ', '.join(worse)}"


def span(numbers, step):
    first, last = numbers["order"][0], numbers["order"][-1]
    row = numbers["steps"]["all"]
    return f"{row[first][step]:.3f} at roughness {first} to {row[last][step]:.3f} at {last}"


def named(numbers, source, names):
    return ", ".join(f"`{name}` {rmse(numbers, source, name):.3f}" for name in names)


def under_light(numbers, group, name):
    """Mean relative RMSE of a composite at the roughnesses under light."""
    found = numbers["lit_means"]
    return " and ".join(f"{found[r][group][name]:.3f}" for r in sorted(found, key=float))


def promised(numbers):
    found = numbers["cones"]
    cone, glass = found[WHITE][TILT], found[GLASS][TILT]
    return f"""\
- **Where visibility is a cone** and bent normals lie within {TILT}° of the normal, the 4-D table misses the BRDF summed
  up over it by {cone[OURS]:.3f} for F₀ = 1 and {glass[OURS]:.3f} for F₀ = 0.04, nearly all of it the missing azimuth
  ({cone[CLOSURE]:.3f} and {glass[CLOSURE]:.3f}); Lagarde's curve by {cone[RIVAL]:.3f} and {glass[RIVAL]:.3f}. Those are
  factors of {cone[RIVAL] / cone[OURS]:.1f} and {glass[RIVAL] / glass[OURS]:.1f}."""


def verdict(numbers):
    first, last = numbers["order"][0], numbers["order"][-1]
    rough = " and ".join(sorted(numbers["lit_means"], key=float))
    screen = ", ".join(f"{rmse(numbers, s, OURS):.3f}" for s in (DENSE, GAME, RECOMMENDED))
    return f"""\
{promised(numbers)}
- **In scenes the factor is {factor(numbers, TRACED):.2f}**, given ray-traced visibility:
  {rmse(numbers, TRACED, OURS):.3f} against {rmse(numbers, TRACED, RIVAL):.3f} in the mean over roughness,
  {factor(numbers, TRACED, first):.2f} at roughness {first}, {factor(numbers, TRACED, last):.2f} at {last}. Visibility
  is no cone there: the BRDF summed up over the cone, which has no other error, is off by
  {span(numbers, "visibility is a cone")}. The 4-D table changes that by {span(numbers, "no azimuth, table")}, the one
  with five axes by {span(numbers, "table of five axes")}: better tables would gain scenes nothing.
- **Cone and lobe, cone and cone**: taking the reflection for a lobe about one direction changes S by
  {span(numbers, "lobe about the reflection")}, taking the lobe for a cone by {span(numbers, "lobe is a cone")}. Both
  reach below surfaces that are seen at an angle, where nothing is visible, and so darken even open ones. Given
  ray-traced visibility they are no better than visibility itself on rough surfaces:
  {crossing(numbers, "cone-lobe", TRACED)}, {crossing(numbers, "cone-cone", TRACED)},
  {crossing(numbers, "cone-cone-published", TRACED)}; the 4-D table {crossing(numbers, OURS, TRACED).partition(" ")[2]}.
- **Apertures**, in the mean over roughness: {named(numbers, TRACED, APERTURES)}. Uniform weighting, whose
  visibility and bent normals cost no more, and know cosine-weighted visibility as well, is the best of them.
- **From the depth buffer** the error of the visibility is on top: dense slices change S by
  {span(numbers, "depth buffer")}. The table's gain on Lagarde's curve shrinks to a factor of
  {factor(numbers, DENSE):.2f} given dense slices, {factor(numbers, GAME):.2f} given few,
  {factor(numbers, RECOMMENDED):.2f} given the recommended pipeline; its errors are {screen}.
- **In images under light**, relative to the mean radiance, at roughness {rough}: S and light both traced, their
  product is off by {under_light(numbers, SPLITS, UNSPLIT)}; with pre-filtered light by
  {under_light(numbers, SPLITS, TRACED_S)}, where that light alone, without occluders, is off by
  {under_light(numbers, LIGHT_ALONE, LIGHT_ALONE)}. Two splits, light and visibility traced together, leave
  {under_light(numbers, SPLITS, TWO)}, three {under_light(numbers, SPLITS, THREE)}. The 4-D table leaves
  {under_light(numbers, TRACED, OURS)} given ray-traced visibility and {under_light(numbers, RECOMMENDED, OURS)} given
  the recommended pipeline, Lagarde's curve {under_light(numbers, TRACED, RIVAL)} and
  {under_light(numbers, RECOMMENDED, RIVAL)}, no occlusion {under_light(numbers, TRACED, "unoccluded")}."""


def section(record):
    numbers, config = record["numbers"], record["config"]
    frames, files = numbers["frames"], [e for e in record["inputs"] if "light" in e]
    notes = "\n".join(f"- {note}" for note in numbers["notes"])
    left_out = f"\n{notes}\n" if notes else ""
    return f"""\
`gtao compare-specular` traces what glossy surfaces reflect of a white dome through whatever stands within the radius,
and compares every method of `gtao.specular_occlusion` with that. Here on {frames["all"]} views,
{frames["embedded"]} of them of embedded scenes, at {config["resolution"]} pixels with {config["spp"]} rays per pixel,
for F₀ = {config["f0"]:g} at roughness {", ".join(numbers["order"])}. Under {len(numbers["lights"])} kinds of light,
{len(files)} of them photographed, images are put together from factors as engines do it. The light turns by
{config["turn"]:g}° from each view to the next.

Errors of S are root mean squares over the pixels, without the noise of the rays (about
{mean(numbers["noise"].values()):.3f} a pixel); those of images are relative to the mean radiance of the view. What
methods are given is kept apart: ray-traced visibility and bent normals isolate the method; dense slices
({DENSE_COUNTS[0]} slices, {DENSE_COUNTS[1]} steps per side) add what a depth buffer cannot know; few slices
({GAME_COUNTS[0]} × {GAME_COUNTS[1]}) and a filter are what a game has; the recommended pipeline is
`gtao.Pipeline.recommended(radius, bent_normal=True)`, a bitmask.

## In short

{verdict(numbers)}

![RMSE of S against roughness, by what methods are given](../references/specular/methods.png)

Means over views and roughness; ranks and first places among the {frames["all"] * len(numbers["order"])} pairs of a view
and a roughness:

{overview(numbers)}

## The methods

{explained()}

All take the published aperture of their weighting, cos α = √(1 − A) or 1 − A, unless they say otherwise; Lagarde's
curve and visibility itself take cosine-weighted visibility.

## By roughness

{matrices(numbers)}

## Where the errors come from

`{EXACT}` sums the BRDF up over the visible cone with the true normal, bent normal and view: whatever it misses, a cone
misses. Steps are root mean squares of the change of S; they do not add up, for they may cancel each other.

![RMS of what each step changes](../references/specular/steps.png)

{steps(numbers)}

## What tables promise, and what scenes keep of it

Random cones, cut by the tangent plane, told to every method as they are: microfacet widths from 0.05 to 1, visibility
of the uncut cone even in [0, 1], reflected directions even over the hemisphere, bent normals tilted from the normal by
angles even up to the one of the column.

{cones(numbers)}

The table without the azimuth is exact where the bent normal is the normal, and gets worse with the tilt. Bent normals
of the views are tilted by {numbers["tilt"]["all"]:.0f}° (root mean square, mean over the views). Lagarde's error over
that of the 4-D table in scenes, by roughness:

{factors(numbers)}

The factors of scenes are smaller because visibility there is no cone. It is cut by edges, walls and posts, and a narrow
lobe sees a single part of it, all or nothing. The cone spreads what is visible evenly about the bent normal, and is off
by what the table "Where the errors come from" says, whatever is computed from it: next to that, the errors of tables
and closures vanish. The rougher the surface, the wider the part that the lobe averages over, and the better the cone.

## Images under light

Radiance over traced radiance: S (F₀ A + B) times the pre-filtered light in the reflected direction. Means over the
kinds of light and views.

{lit(numbers)}

"{UNSPLIT}" multiplies the traced S by the traced radiance without occluders: what is left is that light and visibility
are multiplied instead of integrated together. "{LIGHT_ALONE}" is the same surface without occluders, pre-filtered light
against traced light: the lobe of a probe, with normal and view along its axis, stands for the lobe of the surface.

{folded("By light", lit_by_light(numbers))}
{left_out}
## Pictures

{pictures(record, "specular", ("methods.png", "steps.png"))}

## Maps and scenes of others

None of these files is part of the project.

{credits(record)}
"""
