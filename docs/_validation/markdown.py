"""Tables, numbers, credits and pictures in markdown."""


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def mean(values):
    """Of at least one number."""
    values = list(values)
    return sum(values) / len(values)


def ms(seconds):
    """Milliseconds to three digits."""
    value = 1e3 * seconds
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def folded(title, text):
    """Text behind a title that unfolds it."""
    return f"<details><summary>{title}</summary>\n\n{text}\n\n</details>"


def credits(record):
    """What others made of the inputs of a record: lights, and scenes once each."""
    body = []
    for entry in record["inputs"]:
        if "light" in entry or ("title" in entry and entry["frame"].endswith("camera 0")):
            name = entry.get("light") or entry["frame"].partition(",")[0]
            cells = [entry.get(key) or "–" for key in ("title", "author", "licence", "origin")]
            body.append([name, *cells, f"`{entry['sha256'][:12]}…`"])
    return table(["", "title", "author", "licence", "from", "SHA-256"], body) if body else "None."


def pictures(record, folder, drawn):
    """The outputs of a record in a folder of ``references`` but those that have a place of their own."""
    names = [entry["path"] for entry in record["outputs"] if entry["path"] not in drawn]
    return "\n\n".join(f"![{name.removesuffix('.png')}](../references/{folder}/{name})" for name in names)
