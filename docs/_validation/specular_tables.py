"""Tables of the page on specular occlusion against traced reflections."""

from gtao.workflows.specular.composites import LIGHT_ALONE, OPEN, SPLITS, THREE, TRACED_S, TWO, UNSPLIT
from gtao.workflows.specular.measuring import STEPS
from gtao.workflows.specular.methods import DENSE, EXACT, GAME, RECOMMENDED, REFIT_U, TRACED

from .markdown import folded, mean, table

SOURCES = (TRACED, DENSE, GAME, RECOMMENDED)
#: The table that is looked up, its rival, and the one that ignores directions.
OURS, RIVAL, PLAIN = "brdf-4d", "lagarde", "visibility"
#: Tilt and F0 of the configurations that are closest to those the error of four axes was first measured on.
TILT, WHITE, GLASS = "50", "1", "0.04"

#: Method -> what it is in `gtao.specular_occlusion`, the weighting of what it is given, and what it stands for.
METHODS = {
    EXACT: ("ConeBRDF()", "uniform", "GGX summed up over the cone at every pixel: the cone without any other error"),
    "brdf-5d": ('ConeTable(table=shipped("brdf-5d"))', "uniform", "the same from a table of five axes"),
    OURS: ("ConeTable()", "uniform", "from a table of four: without the azimuth of the bent normal"),
    "brdf-4d-tilted": ('ConeTable(aperture="tilted")', "cosine", "the same, aperture corrected for the tilt"),
    "brdf-4d-matched": ('ConeTable(aperture="matched")', "cosine", "the same, aperture matched to the visibility"),
    "brdf-4d-published": ("ConeTable()", "cosine", "the same, published aperture"),
    "brdf-3d": ('ConeTable(table=bake("brdf-3d"))', "uniform", "from a table of three: the bent normal for the normal"),
    "cone-lobe": ("ConeLobe()", "uniform", "the lobe of a probe within the cone"),
    "cone-lobe-phong": ('ConeLobe(distribution="phong")', "uniform", "the same with a Phong lobe"),
    "cone-cone": ("ConeCone()", "uniform", "the share of a reflection cone"),
    "cone-cone-published": ("ConeCone()", "cosine", "the same, published aperture of the visibility cone"),
    "cone-cone-refit": (f"ConeCone(u={REFIT_U:g})", "uniform", "with u refitted by DSSIM (fits/aperture)"),
    "cone-cone-oat": ('ConeCone(intersection="oat")', "uniform", "with the intersection of Oat and Sander 2007"),
    "cone-cone-drobot": ('ConeCone(reflection="drobot")', "uniform", "with the reflection cone of Drobot 2014"),
    "cone-cone-uludag": ('ConeCone(reflection="uludag")', "uniform", "with that of Uludag 2014"),
    RIVAL: ("Lagarde2014()", "cosine", "a curve of visibility, roughness and view angle"),
    PLAIN: ("VisibilityAsSpecular()", "cosine", "visibility taken for specular occlusion"),
    "unoccluded": ("–", "–", "S = 1"),
}


def rmse(numbers, source, name, scope="all"):
    """Mean RMSE over the roughnesses."""
    return mean(row[name]["rmse"] for row in numbers["dome"][scope][source].values())


def at(numbers, source, name, roughness, scope="all"):
    return numbers["dome"][scope][source][roughness][name]["rmse"]


def bold(values, shown="{:.3f}"):
    """The lowest in bold, None as a dash."""
    least = min(v for v in values if v is not None)
    texts = ["–" if v is None else shown.format(v) for v in values]
    return [f"**{text}**" if v == least else text for v, text in zip(values, texts, strict=True)]


def by_error(numbers, source, scope="all"):
    names = [name for name in METHODS if name in numbers["dome"][scope][source][numbers["order"][0]]]
    return sorted(names, key=lambda name: rmse(numbers, source, name, scope))


def columns(names, found):
    """Rows of a table: a method, and the bold lowest of every column."""
    cells = [bold(column) for column in found]
    return [[f"`{name}`", *(column[i] for column in cells)] for i, name in enumerate(names)]


def overview(numbers):
    """Mean over roughness and frames, by source, of all frames and of those of files."""
    names = by_error(numbers, TRACED)
    found = [[rmse(numbers, source, name) for name in names] for source in SOURCES]
    cells = columns(names, found)
    for i, name in enumerate(names):
        cells[i] += [
            f"{row['rank']:.1f} ({row['wins']})" for row in (numbers["overall"][s][name] for s in (TRACED, RECOMMENDED))
        ]
    head = ["method", *SOURCES, f"rank (first): {TRACED}", f"rank (first): {RECOMMENDED}"]
    return table(head, cells)


def matrix(numbers, source, scope="all"):
    """A row per method and a column per roughness."""
    names = by_error(numbers, source, scope)
    found = [[rmse(numbers, source, name, scope) for name in names]]
    found += [[at(numbers, source, name, r, scope) for name in names] for r in numbers["order"]]
    return table(["method", "mean", *numbers["order"]], columns(names, found))


def biases(numbers):
    """Mean of estimate minus truth over roughness and frames: a row per method and a column per source."""
    dome = numbers["dome"]["all"]
    names = by_error(numbers, TRACED)
    values = [[mean(row[name]["bias"] for row in dome[s].values()) for s in SOURCES] for name in names]
    body = [[f"`{name}`", *(f"{v:+.3f}" for v in row)] for name, row in zip(names, values, strict=True)]
    return table(["method", *SOURCES], body)


def matrices(numbers):
    parts = [f"Given {TRACED}:\n\n{matrix(numbers, TRACED)}"]
    parts += [folded(f"Given {source}", matrix(numbers, source)) for source in SOURCES[1:]]
    for scope, words in (("embedded", "embedded scenes only"), ("files", "scenes of others only")):
        if scope in numbers["dome"] and len(numbers["dome"]) > 2:
            parts.append(folded(f"Given {TRACED}, {words}", matrix(numbers, TRACED, scope)))
            parts.append(folded(f"Given {RECOMMENDED}, {words}", matrix(numbers, RECOMMENDED, scope)))
    parts.append(folded("Mean of estimate minus truth, over roughness: negative is too dark", biases(numbers)))
    return "\n\n".join(parts)


def steps(numbers):
    found = numbers["steps"]["all"]
    body = []
    for name, (before, after) in STEPS.items():
        first = "truth" if before is None else words_of(before)
        body.append([name, f"{first} → {words_of(after)}", *(f"{found[r][name]:.3f}" for r in numbers["order"])])
    return table(["step", "from → to", *numbers["order"]], body)


def words_of(stage):
    source, name = stage
    return f"`{name}`" if source == TRACED else f"`{name}`, {source}"


def factor(numbers, source, roughness=None, scope="all"):
    """How many times as large Lagarde's error is as that of the table."""
    if roughness is None:
        return rmse(numbers, source, RIVAL, scope) / rmse(numbers, source, OURS, scope)
    return at(numbers, source, RIVAL, roughness, scope) / at(numbers, source, OURS, roughness, scope)


def cones(numbers):
    found = numbers["cones"]
    keys = [(f0, tilt) for f0 in found for tilt in sorted(found[f0], key=float)]
    names = sorted(found[WHITE][TILT], key=found[WHITE][TILT].__getitem__)
    body = [[f"`{n}`" if n in METHODS else n, *(f"{found[f0][tilt][n]:.3f}" for f0, tilt in keys)] for n in names]
    body.append(["Lagarde over 4-D", *(f"{found[f][t][RIVAL] / found[f][t][OURS]:.1f}" for f, t in keys)])
    return table(["method", *(f"F₀ = {f0}, up to {tilt}°" for f0, tilt in keys)], body)


def factors(numbers):
    """Lagarde's error over that of the table in scenes: a row per source, a column per roughness."""
    body = []
    for scope, words in (("all", "all views"), ("embedded", "embedded scenes"), ("files", "scenes of others")):
        if scope in numbers["dome"]:
            for source in SOURCES:
                cells = [f"{factor(numbers, source, r, scope):.2f}" for r in numbers["order"]]
                body.append([words, source, f"{factor(numbers, source, None, scope):.2f}", *cells])
    return table(["views", "given", "mean", *numbers["order"]], body)


def lit_matrix(numbers, roughness):
    """Composites with the traced factors first; a column per source."""
    groups = numbers["lit_means"][roughness]
    parts = [[f"{name}", f"{groups[SPLITS][name]:.3f}"] for name in (UNSPLIT, TWO, TRACED_S, THREE, OPEN)]
    parts.append([f"{LIGHT_ALONE} (against light traced without occluders)", f"{groups[LIGHT_ALONE][LIGHT_ALONE]:.3f}"])
    names = sorted((n for n in METHODS if n in groups[TRACED]), key=groups[TRACED].__getitem__)
    found = [[groups[source][name] for name in names] for source in SOURCES]
    first = table(["traced factors", "RMSE"], parts)
    return f"{first}\n\n{table(['S from', *SOURCES], columns(names, found))}"


def lit(numbers):
    return "\n\n".join(f"Roughness {r}:\n\n{lit_matrix(numbers, r)}" for r in sorted(numbers["lit_means"], key=float))


def lit_by_light(numbers):
    """Traced factors and the main methods under every light."""
    body = []
    for light in numbers["lights"]:
        for r in sorted(numbers["lit"][light], key=float):
            groups = numbers["lit"][light][r]
            cells = [groups[SPLITS][name]["rmse"] for name in (UNSPLIT, TWO, TRACED_S)]
            cells += [groups[s][n]["rmse"] for s in (TRACED, RECOMMENDED) for n in (OURS, "cone-cone", RIVAL)]
            cells.append(groups[TRACED]["unoccluded"]["rmse"])
            body.append([light, r, *(f"{v:.3f}" for v in cells), str(numbers["lit_frames"][light][r])])
    head = ["light", "roughness", UNSPLIT, TWO, TRACED_S]
    head += [f"`{n}`, {words}" for words in ("traced", "recommended") for n in (OURS, "cone-cone", RIVAL)]
    return table([*head, "`unoccluded`", "views"], body)


def explained():
    rows = [[f"`{name}`", f"`{call}`", weighting, words] for name, (call, weighting, words) in METHODS.items()]
    return table(["method", "`gtao.specular_occlusion` with", "given", "stands for"], rows)
