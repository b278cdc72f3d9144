"""What the project wants to reach, beside what was measured."""

__all__ = ["HEAD", "check", "rows"]

HEAD = ("", "at", "wanted", "best", "median", "")
ESTIMATE, GRADIENT, PACKAGE = "estimate", "estimate and gradients", "gtao"
FUSED = f"{GRADIENT}, fused"
CPP = ("C++, scalar loads", "C++, vector gathers")
#: Where comparisons are made, the quick ones last.
SIZES = ("1080p", "540p")


def _entry(numbers, section, **keys):
    """The first entry of a section that has all these values; LookupError if there is none."""
    for entry in numbers[section]["entries"]:
        if all(entry[key] == value for key, value in keys.items()):
            return entry
    raise LookupError(keys)


def _main_size(numbers, section):
    sizes = {entry["size"] for entry in numbers[section]["entries"]}
    return next(size for size in SIZES if size in sizes)


def _over(rows, name, others):
    """Best and median seconds of a row over those of the fastest of others."""
    return tuple(rows[name][key] / min(rows[o][key] for o in others if o in rows) for key in ("best_s", "median_s"))


def _against_cpp(counts):
    def find(n):
        size = _main_size(n, "forward")
        return size, *_over(_entry(n, "forward", size=size, counts=counts)["rows"], PACKAGE, CPP)

    return find


def _against(rival):
    """How many times as fast as a rival, where the advantage is the least."""

    def find(n):
        size = _main_size(n, "forward")
        tables = [e["rows"] for e in n["forward"]["entries"] if rival in e["rows"] and e["size"] == size]
        return size, *map(min, zip(*(_over(rows, rival, [PACKAGE]) for rows in tables), strict=True))

    return find


def _gradient(counts, kind=GRADIENT):
    def find(n):
        size = _main_size(n, "gradient")
        return size, *_over(_entry(n, "gradient", size=size, counts=counts)["rows"], kind, [ESTIMATE])

    return find


def _directions(counts, kind):
    def find(n):
        size = _main_size(n, "directions")
        entry = _entry(n, "directions", size=size, counts=counts, method="linear falloff")
        return size, *_over(entry["rows"], kind, ["visibility"])

    return find


def _torch(kind):
    def find(n):
        size, theirs = _main_size(n, "gradient"), f"PyTorch, {GRADIENT}"
        rows = next(e["rows"] for e in n["gradient"]["entries"] if e["size"] == size and theirs in e["rows"])
        return size, *_over(rows, theirs, [kind])

    return find


def _memory(what, size, unit, key):
    return lambda n: (size, _entry(n, "memory", what=what, size=size, counts="1x8")[key] / unit, None)


def _call(n):
    row = _entry(n, "overhead", counts="1x8")["rows"][ESTIMATE]
    return "64×64", 1e3 * row["best_s"], 1e3 * row["median_s"]


def _first_frame(state):
    def find(n):
        row = _entry(n, "startup", counts="1x8", what=ESTIMATE)[state]
        return "64×64", row["first_s"], row["first_median_s"]

    return find


def _linear(n):
    """Time per pixel at 4K over that at 540p."""
    large, small = (_entry(n, "forward", size=size, counts="1x8") for size in ("4K", "540p"))
    factor = small["taps"] / large["taps"]
    return "4K", *(large["rows"][PACKAGE][k] / small["rows"][PACKAGE][k] * factor for k in ("best_s", "median_s"))


def _pyramid_radius(kind):
    def find(n):
        entry = _entry(n, "pyramid", counts="1x8")
        return entry["size"], *_over(entry["rows"], f"weighted, 4 radii{kind}", [f"weighted, radius{kind}"])

    return find


def _pyramid_size(n):
    entry = _entry(n, "pyramid", counts="1x8")
    over = _over(entry["rows"], "weighted, radius", [f"weighted, {entry['small']}"])
    return entry["size"], *(value / entry["pixel_ratio"] for value in over)


def _device(counts, key):
    def find(n):
        if n["device"]["backend"] != "cuda":
            raise LookupError("no GPU")
        return "1080p", 1e3 * _entry(n, "device", what=ESTIMATE, counts=counts)[key], None

    return find


def _pipeline(n):
    """Kernels of all stages of the published pipeline."""
    if n["pipeline"]["backend"] != "cuda":
        raise LookupError("no GPU")
    return n["pipeline"]["size"], 1e3 * n["pipeline"]["kernels"]["all stages"], None


#: (what, limit, whether it is the most or the least, where it is found)
GOALS = (
    ("1x8 over C++", 1.25, True, _against_cpp("1x8")),
    ("3x3 over C++", 1.15, True, _against_cpp("3x3")),
    ("9x3 over C++", 1.15, True, _against_cpp("9x3")),
    ("16x16 over C++", 1.30, True, _against_cpp("16x16")),
    ("times as fast as Numba", 7.5, False, _against("Numba")),
    ("times as fast as NumPy", 10.0, False, _against("NumPy, 16 rows at a time")),
    ("with gradients over without, 1x8", 2.7, True, _gradient("1x8")),
    ("with gradients over without, 1x32", 1.5, True, _gradient("1x32")),
    ("with fused gradients over without, 1x8", 2.2, True, _gradient("1x8", FUSED)),
    ("with fused gradients over without, 1x32", 1.4, True, _gradient("1x32", FUSED)),
    ("gradients, times as fast as PyTorch", 15.0, False, _torch(GRADIENT)),
    ("fused gradients, times as fast as PyTorch", 15.0, False, _torch(FUSED)),
    ("bent normals over visibility alone, 1x8", 1.15, True, _directions("1x8", "bent normals")),
    ("bent normals over visibility alone, 9x3", 1.15, True, _directions("9x3", "bent normals")),
    ("nine harmonics over visibility alone, 1x8", 1.35, True, _directions("1x8", "spherical harmonics")),
    ("nine harmonics over visibility alone, 9x3", 1.35, True, _directions("9x3", "spherical harmonics")),
    ("memory with gradients, MB", 60.0, True, _memory(GRADIENT, "1080p", 1e6, "dr")),
    ("memory with fused gradients, MB", 60.0, True, _memory(FUSED, "1080p", 1e6, "dr")),
    ("memory, GB", 1.0, True, _memory(ESTIMATE, "8K", 1e9, "process")),
    ("call, ms", 0.6, True, _call),
    ("first frame, empty kernel cache, s", 0.2, True, _first_frame("cold")),
    ("first frame, warm kernel cache, s", 0.03, True, _first_frame("warm")),
    ("time per pixel over 540p, 1x8", 1.15, True, _linear),
    ("pyramid: 4 radii over one", 1.2, True, _pyramid_radius("")),
    ("pyramid of a new frame: 4 radii over one", 1.2, True, _pyramid_radius(", new frame")),
    ("pyramid: time per sample over a quarter of the pixels", 1.15, True, _pyramid_size),
    ("GPU: kernels, 1x8, ms", 0.1, True, _device("1x8", "kernels_s")),
    ("GPU: kernels, 9x3, ms", 0.3, True, _device("9x3", "kernels_s")),
    ("GPU: frozen call, 1x8, ms", 0.3, True, _device("1x8", "frozen_s")),
    ("GPU: kernels of the published pipeline, ms", 0.1, True, _pipeline),
)


def check(numbers):
    """Every goal whose numbers were measured, as plain values."""
    found = []
    for what, limit, at_most, find in GOALS:
        try:
            at, best, median = find(numbers)
        # A section that did not run, or a rival that is missing.
        except (LookupError, StopIteration, ValueError):
            continue
        met = best <= limit if at_most else best >= limit
        row = {"what": what, "at": at, "limit": limit, "at_most": at_most, "best": best, "median": median, "met": met}
        found.append(row)
    return found


def rows(found):
    return [
        (
            goal["what"],
            goal["at"],
            f"{'≤' if goal['at_most'] else '≥'} {goal['limit']:g}",
            f"{goal['best']:.3g}",
            "" if goal["median"] is None else f"{goal['median']:.3g}",
            "yes" if goal["met"] else "no",
        )
        for goal in found
    ]
