"""`python -m tools.screenshots [--report DIR]`: the first screen of a report into docs/images."""

from __future__ import annotations

import argparse
import io
import sys
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.store.files import write_if_changed
from tools.browser import browser, missing

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs/images"
#: A page is some inks and their edges: more shades are hardly seen, and cost bytes. The opening
#: picture has a field of pressure, which needs them.
COLOURS = 32
OPENING_COLOURS = 128
#: Pixels: the opening picture is as wide as a column of text, on a fine screen.
OPENING_WIDTH = 1300
#: All of docs/images: they travel with each clone.
MAX_BYTES = 400_000


#: Width and height of the first page of a report, CSS pixels.
SCREEN = (1300, 1450)
#: Numbers that docs/reading-the-report.md explains, at the parts of the page.
NUMBERS = """
['header img', '.answer', '.forest', '.cards', 'footer'].forEach((part, i) => {
  const box = document.querySelector(part).getBoundingClientRect()
  const label = document.createElement('b')
  label.textContent = i + 1
  label.style = 'position: absolute; width: 26px; text-align: center; border-radius: 13px; ' +
    `color: white; background: black; top: ${box.top + scrollY}px; left: ${box.right - 26}px`
  document.body.append(label)
})
"""


def screenshot(page: Path) -> bytes:
    """Return the first screen of a page as PNG."""
    with browser() as window:
        window.window(*SCREEN, scale=1)
        window.medium(dark=False, printed=False)
        window.open(page.resolve().as_uri())
        window.run(NUMBERS)
        return small(window.picture())


def small(png: bytes, colours: int = COLOURS, width: int = 0) -> bytes:
    """Return a picture in few colours, a quarter of the bytes, and so wide at most (0: as is)."""
    from PIL import Image

    with Image.open(io.BytesIO(png)) as whole:
        picture = whole.convert("RGB")
    if 0 < width < picture.width:
        picture = picture.resize((width, round(picture.height * width / picture.width)))
    rare_too = Image.Quantize.MAXCOVERAGE  # a badge is few pixels
    few = picture.quantize(colours, rare_too, dither=Image.Dither.NONE)
    stream = io.BytesIO()
    few.save(stream, format="PNG", optimize=True)
    return stream.getvalue()


def write_screenshots(page: Path) -> None:
    """Write a report's opening picture and its first screen to docs/images; say what is missing if
    that cannot be."""
    drawn = page.parent / Paths().opening.relative_to(Paths().report.parent)
    opening = drawn.with_suffix(".png")
    if opening.is_file():
        _write("opening", small(opening.read_bytes(), OPENING_COLOURS, OPENING_WIDTH))
    if not page.is_file():
        print(f"screenshots: left as they were, there is no {page}")
    elif what := missing():
        print(f"screenshots: left as they were, not installed: {what}")
    else:
        _write("report", screenshot(page))
    size = sum(file.stat().st_size for file in IMAGES.iterdir())
    if size > MAX_BYTES:
        sys.exit(f"docs/images: {size / 1000:.0f} kB, more than {MAX_BYTES / 1000:.0f}")


def _write(name: str, png: bytes) -> None:
    if write_if_changed(IMAGES / f"{name}.png", png):
        print(f"wrote docs/images/{name}.png ({len(png) / 1000:.0f} kB)")


def main() -> None:
    """Write the screenshots of a report."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--report", type=Path, default=Paths().report.parent)
    write_screenshots(options.parse_args().report / Paths().report.name)


if __name__ == "__main__":
    main()
