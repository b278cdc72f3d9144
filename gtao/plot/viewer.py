"""Images of one scene in a page: a gallery, and a viewer that slides between any two of them."""

import html
import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image

from .comparison_images import error_limit, error_of
from .images import displayed
from .markup import data_uri
from .style import NO_VALUE, SIGNED

__all__ = ["VIEWER_SCRIPT", "VIEWER_STYLE", "error_png", "viewer", "visibility_png"]

#: Pixels without a value have the last entry of a palette; all others are steps of the scale.
_STEPS = 255

VIEWER_STYLE = """
.stage { position: relative; margin: 1rem auto .5rem; width: min(100%, 64rem, calc(80vh * var(--aspect)));
  aspect-ratio: var(--aspect); overflow: hidden; border-radius: .6rem; border: 1px solid var(--line); --split: 50%; }
.stage img { position: absolute; inset: 0; width: 100%; height: 100%; max-width: none; padding: 0; border: 0;
  border-radius: 0; image-rendering: pixelated; }
.stage .left { clip-path: inset(0 calc(100% - var(--split)) 0 0); }
.stage .line { position: absolute; inset: 0 auto 0 var(--split); width: 2px; margin-left: -1px; background: #fff;
  box-shadow: 0 0 4px #000a; pointer-events: none; }
.stage .line::after { content: "\\2194"; position: absolute; top: 50%; left: 50%; translate: -50% -50%; width: 2rem;
  height: 2rem; line-height: 1.9rem; text-align: center; border-radius: 50%; background: #fff; color: #1d2329;
  box-shadow: 0 0 4px #0008; }
.stage input { position: absolute; inset: 0; width: 100%; height: 100%; margin: 0; opacity: 0; cursor: ew-resize; }
.stage:has(input:focus-visible) { outline: 3px solid var(--blue); outline-offset: 2px; }
.tag { position: absolute; top: .6rem; max-width: 46%; padding: .15rem .6rem; border-radius: 1rem; font-size: .8rem;
  background: #1d2329cc; color: #fff; pointer-events: none; }
.tag.at-left { left: .6rem; } .tag.at-right { right: .6rem; text-align: right; }
.choose { display: flex; flex-wrap: wrap; gap: .5rem 1.5rem; justify-content: center; font-size: .85rem;
  color: var(--muted); margin-bottom: 1.25rem; }
.choose select { font: inherit; color: var(--ink); background: var(--card); border: 1px solid var(--line);
  border-radius: .4rem; padding: .2rem .4rem; max-width: 18rem; }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(13.5rem, 1fr)); gap: .9rem; margin: 1rem 0; }
.card { margin: 0; background: var(--card); border: 1px solid var(--line); border-radius: .6rem; padding: .5rem; }
.card.mine { border: 2px solid var(--blue); }
.card figcaption { margin: .4rem .2rem 0; line-height: 1.4; }
.card figcaption b { color: var(--ink); }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: .3rem; }
.shot { padding: 0; border: 0; background: none; cursor: zoom-in; font: inherit; border-radius: .3rem; }
.shot img { width: 100%; padding: 0; border: 0; border-radius: .3rem; }
.shot:hover img { filter: brightness(1.08); }
.shot:focus-visible { outline: 3px solid var(--blue); outline-offset: 1px; }
.scale { display: flex; align-items: center; gap: .75rem; font-size: .8rem; color: var(--muted);
  margin: .25rem 0 1rem; }
.scale i { flex: 0 1 18rem; height: .8rem; border-radius: .4rem; border: 1px solid var(--line); }
@media print { .viewer { display: none; } }
"""

VIEWER_SCRIPT = """
for (const box of document.querySelectorAll(".compare")) {
  const shots = [...box.querySelectorAll(".shot img")], stage = box.querySelector(".stage");
  const range = stage.querySelector("input"), picks = [...box.querySelectorAll("select")];
  const show = (side, i) => {
    const image = stage.querySelector(side ? ".right" : ".left"), shot = shots[i];
    image.src = shot.src;
    image.alt = stage.querySelector(side ? ".at-right" : ".at-left").textContent = shot.alt;
    picks[side].value = i;
  };
  const slide = (percent) => { range.value = percent; stage.style.setProperty("--split", range.value + "%"); };
  shots.forEach((shot, i) => {
    for (const pick of picks) pick.append(new Option(shot.alt, i));
    shot.parentNode.addEventListener("click", () => {
      show(0, i);
      stage.scrollIntoView({ block: "nearest", behavior: "smooth" });
    });
  });
  picks.forEach((pick, side) => pick.addEventListener("change", () => show(side, pick.value)));
  range.addEventListener("input", () => slide(range.value));
  stage.addEventListener("pointermove", (event) => {
    if (event.pointerType !== "mouse") return;
    const frame = stage.getBoundingClientRect();
    slide((100 * (event.clientX - frame.left)) / frame.width);
  });
  show(0, Number(box.dataset.start));
  show(1, 0);
  box.querySelector(".viewer").hidden = false;
}
"""


def visibility_png(image: Any, mask: Any = None) -> bytes:
    """Visibility as a small PNG file: (H, W), display encoding, the background neutral."""
    values = np.asarray(image, dtype=float)
    keep = np.isfinite(values) if mask is None else np.isfinite(values) & np.asarray(mask, dtype=bool)
    share = displayed(np.where(keep, values, 0.0), (0.0, 1.0))[..., 0] / 255
    grey = np.repeat(np.linspace(0, 1, _STEPS)[:, None], 3, axis=1)
    return _indexed_png(share, keep, grey)


def error_png(error: Any, limit: float) -> bytes:
    """A signed error as a small PNG file: (H, W), clipped to ±limit, NaN neutral."""
    values = np.asarray(error, dtype=float)
    keep = np.isfinite(values)
    share = np.clip(np.where(keep, values, 0.0) / (2 * limit) + 0.5, 0, 1)
    return _indexed_png(share, keep, SIGNED(np.linspace(0, 1, _STEPS))[:, :3])


def viewer(
    truth: Any,
    images: Mapping[str, Any],
    *,
    mask: Any = None,
    captions: Mapping[str, str] | None = None,
    ours: str | None = None,
    reference: str = "ray-traced truth",
) -> str:
    """The truth, every image and its signed error, each once; without a script a gallery, with it a slider on top.

    Args:
        truth: (H, W) visibility.
        images: (H, W) visibility by label.
        mask: (H, W) bool; the other pixels are drawn as background.
        captions: HTML below the label, by label.
        ours: Label to emphasise and to start with; the first if None.
        reference: Label of the truth.

    Returns:
        HTML, to go with :data:`VIEWER_STYLE` and :data:`VIEWER_SCRIPT`. All errors have one scale, which ends at the
        99th percentile of the absolute errors of all images together.
    """
    errors = {label: error_of(image, truth, mask) for label, image in images.items()}
    limit = error_limit(errors)
    cards = [_card(reference, [(reference, visibility_png(truth, mask))], "white is open, black is closed", "")]
    for label, image in images.items():
        shots = [(label, visibility_png(image, mask)), (f"{label}: error", error_png(errors[label], limit))]
        cards.append(_card(label, shots, (captions or {}).get(label, ""), " mine" if label == ours else ""))
    labels = list(images)
    start = 1 + 2 * labels.index(ours) if ours in images else int(bool(images))
    height, width = np.shape(truth)
    colours = ", ".join(
        f"rgb({r * 100:.1f}% {g * 100:.1f}% {b * 100:.1f}%)" for r, g, b, _ in SIGNED(np.linspace(0, 1, 9))
    )
    return (
        f"<div class=compare data-start={start} style='--aspect: {width / height:.5f}'><div class=viewer hidden>"
        "<div class=stage><img class=right alt=''><img class=left alt=''>"
        "<span class='tag at-left'></span><span class='tag at-right'></span><div class=line></div>"
        "<input type=range min=0 max=100 step=0.1 value=50 aria-label='Position of the divider'></div>"
        "<div class=choose><label>left <select></select></label><label>right <select></select></label></div></div>"
        f"<div class=cards>{''.join(cards)}</div>"
        f"<div class=scale>error: −{limit:.3f} <i style='background: linear-gradient(to right, {colours})'></i> "
        f"+{limit:.3f} (blue too dark, red too bright)</div></div>"
    )


def _card(title: str, shots: list[tuple[str, bytes]], caption: str, mark: str) -> str:
    buttons = "".join(
        f"<button type=button class=shot title='Show on the left'><img alt=\"{html.escape(label)}\" "
        f'src="{data_uri(png)}"></button>'
        for label, png in shots
    )
    words = f"<figcaption><b>{html.escape(title)}</b>{'<br>' + caption if caption else ''}</figcaption>"
    return f"<figure class='card{mark}'><div class=pair>{buttons}</div>{words}</figure>"


def _indexed_png(share: np.ndarray, keep: np.ndarray, colours: np.ndarray) -> bytes:
    """A PNG file with a palette: shares of the scale in [0, 1], and a neutral colour where nothing is to be kept."""
    index = np.where(keep, np.rint(share * (_STEPS - 1)), _STEPS).astype(np.uint8)
    image = Image.fromarray(index)
    image.putpalette(np.rint(255 * np.vstack([colours, to_rgb(NO_VALUE)])).astype(np.uint8).tobytes())
    buffer = io.BytesIO()
    image.save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()
