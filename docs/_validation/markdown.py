"""Tables in markdown."""


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def folded(title, text):
    """Text behind a title that unfolds it."""
    return f"<details><summary>{title}</summary>\n\n{text}\n\n</details>"
