"""Tables of the production pipeline over time, from ``references/temporal``."""

from .markdown import mean, table

PUBLISHED, NO_CLAMP = "published", "no clamp"
#: Single frames: of the pipeline's resolution and of the frame's.
SINGLE, FULL = "half resolution", "full resolution"
CYCLE = 24


def at(curve, k):
    """Value of a curve after k frames."""
    return curve[str(k)]


def ratio(row, single=SINGLE):
    """Error after a cycle over that of a single frame with 96 directions, of one resolution or the other."""
    return at(row["variants"][PUBLISHED]["truth"], CYCLE) / row["singles"][single]["truth"]


def later(row):
    """Bias in the last frames of all cycles but the first, where it is largest."""
    return max(row["cycles"][PUBLISHED]["last"][1:], key=abs)


def over_scenes(rows, pick):
    return mean(pick(row) for row in rows.values())


def settled(still):
    """Every scene: how errors fall, and what is left."""
    body = []
    for scene, row in still.items():
        ours, limit = row["variants"][PUBLISHED], row["variants"][PUBLISHED]["limit"]
        cycles = row["cycles"][PUBLISHED]
        body.append(
            [
                scene,
                *(f"{at(ours['truth'], k):.4f}" for k in (1, 6, CYCLE)),
                f"{row['singles'][SINGLE]['truth']:.4f}",
                f"{row['singles'][SINGLE + ', filtered']['truth']:.4f}",
                f"{ratio(row):.3f}",
                f"{row['singles'][FULL]['truth']:.4f}",
                f"{ratio(row, FULL):.3f}",
                f"{at(limit['rmse'], 1):.4f}",
                f"{at(limit['rmse'], CYCLE):.4f}",
                f"{at(limit['bias'], CYCLE):+.5f}",
                f"{later(row):+.5f}",
                f"{cycles['mean'][-1]:+.5f}",
                f"{cycles['last'][-1] - cycles['last'][0]:+.5f}",
            ]
        )
    head = ["scene", "1 frame", "6", "24", "96 directions", "filtered", "ratio", "full resolution", "ratio"]
    return table([*head, "limit: 1 frame", "24", "bias", "later", "mean bias", "drift"], body)


def stages(still):
    """What every stage buys, means over the scenes."""
    names = list(next(iter(still.values()))["variants"])
    body = []
    for name in [PUBLISHED, *(n for n in names if n != PUBLISHED)]:
        rows = [row["variants"][name] for row in still.values()]
        body.append(
            [
                name,
                *(f"{mean(at(r['truth'], k) for r in rows):.4f}" for k in (1, CYCLE)),
                *(f"{mean(at(r['limit']['rmse'], k) for r in rows):.4f}" for k in (1, CYCLE)),
                f"{mean(abs(at(r['limit']['bias'], CYCLE)) for r in rows):.4f}",
                f"{mean(r['flicker'] for r in rows):.4f}",
            ]
        )
    head = ["pipeline", "to truth: 1 frame", "24 frames", "to its limit: 1 frame", "24 frames", "bias", "flicker"]
    return table(head, body)


def floors(still):
    """Errors that no number of frames takes away."""
    body = []
    for scene, row in still.items():
        limits, filtered = row["limits"], row["filtered limit"]
        body.append(
            [
                scene,
                f"{limits['limit']['truth']:.4f}",
                f"{limits['limit']['bias to truth']:+.4f}",
                f"{limits['all samples']['truth']:.4f}",
                f"{limits['all samples']['bias to limit']:+.4f}",
                f"{limits['jittered']['bias to limit']:+.4f}",
                f"{filtered['limit']:.4f}",
                f"{filtered['bias']:+.4f}",
            ]
        )
    head = ["scene", "limit to truth", "bias to truth", "128 samples to truth", "128 samples", "even offsets"]
    return table([*head, "filters", "bias of filters"], body)


def patterns(numbers):
    """Noise patterns, means over the scenes."""
    first = next(iter(numbers.values()))
    body = []
    for name in first[NO_CLAMP]:
        cells = [f"`{name}`"]
        for clamp in ("clamp", NO_CLAMP):
            rows = [by_clamp[clamp][name] for by_clamp in numbers.values()]
            cells += [f"{mean(at(r['jittered']['rmse'], k) for r in rows):.4f}" for k in (1, 6, CYCLE)]
            cells.append(f"{mean(r['flicker'] for r in rows):.4f}")
        body.append(cells)
    head = ["pattern", "1 frame", "6", "24", "flicker", "no clamp: 1 frame", "6", "24", "flicker"]
    return table(head, body)


def number(value, form):
    return "–" if value is None else format(value, form)


def ghosts(entry):
    """One animation: every pipeline."""
    body = []
    for name, row in entry["pipelines"].items():
        ghost, flicker = row["ghosting"], row["flicker"]
        cells = [name, number(ghost["energy"], "+.5f"), number(ghost["elsewhere"], "+.5f")]
        cells += [number(ghost[key], "+.4f") for key in ("lag", "behind", "ahead")]
        cells += [number(flicker[key], ".4f") for key in ("deviation", "step")]
        cells.append(f"{mean(row['rmse']):.4f}")
        body.append(cells)
    head = ["pipeline", "energy", "elsewhere", "lag", "behind", "ahead", "flicker", "step", "RMSE"]
    return table(head, body)


def window_table(numbers):
    widths = sorted(next(iter(numbers.values())), key=float)
    body = []
    for width in widths:
        cells = [width]
        for row in numbers.values():
            ghost, flicker = row[width]["ghosting"], row[width]["flicker"]
            cells += [f"{ghost['energy']:+.5f}", f"{ghost['lag']:+.4f}", f"{flicker['deviation']:.4f}"]
        body.append(cells)
    head = ["window", *(f"{name}: {what}" for name in numbers for what in ("energy", "lag", "flicker"))]
    return table(head, body)


def convergence(entry):
    found = {name: row.get("convergence") for name, row in entry["pipelines"].items()}
    return ", ".join(f"{'never' if n is None else n} ({name})" for name, n in found.items())
