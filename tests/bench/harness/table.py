"""Tables on the terminal."""

__all__ = ["HEAD", "milliseconds", "ratio_rows", "show"]

#: Columns of :func:`ratio_rows`.
HEAD = ("", "best ms", "median ms", "ratio of bests", "median ratio", "half of the ratios")


def milliseconds(value):
    """Three digits, whatever the size."""
    value *= 1e3
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def ratio_rows(rows):
    """Rows of what :func:`.clock.summary` returns."""
    return [
        (
            name,
            milliseconds(row["best_s"]),
            milliseconds(row["median_s"]),
            f"{row['ratio']['best']:.2f}",
            f"{row['ratio']['median']:.2f}",
            f"{row['ratio']['low']:.2f} … {row['ratio']['high']:.2f}",
        )
        for name, row in rows.items()
    ]


def show(title, head, rows):
    """Print a table: first column left, the others right."""
    lines = [tuple(map(str, row)) for row in (head, *rows)]
    widths = [max(len(row[i]) for row in lines) for i in range(len(head))]
    print(f"\n{title}")
    for row in lines:
        cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
        print("  " + "  ".join(cells).rstrip(), flush=True)
