"""`python -m tools.screenshots [--report DIR]`: write pictures of a report to docs/images."""

from __future__ import annotations

import argparse
import io
import sys
from pathlib import Path

from PIL import Image

from ajgdata.paths import Paths
from ajgdata.store.files import write_if_changed
from tools.browser import browser, missing

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs/images"
# Numbers of colours: few colours give small files.
COLOURS = 32  #: a page has few colours and their edges
OPENING_COLOURS = 128  #: the opening picture shows a pressure field, which has many shades
#: Largest width of the opening picture in pixels: a column of text on a high-resolution screen.
OPENING_WIDTH = 1300
#: Largest size of all files in docs/images, because each clone downloads them.
MAX_BYTES = 900_000
#: Width of the first page of a report in CSS pixels.
WIDTH = 1300
#: Script that returns the height of the page, with a margin below the footer.
HEIGHT = """
const footer = document.querySelector('footer').getBoundingClientRect()
return Math.ceil(footer.bottom + scrollY) + 16
"""
#: Script that adds numbers to the parts of the page. docs/reading-the-report.md explains them.
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
    """Return the first page of a report with numbered parts as PNG."""
    with browser() as window:
        window.window(WIDTH)
        window.medium(dark=False, printed=False)
        window.open(page.resolve().as_uri())
        height = window.run(HEIGHT)
        window.window(WIDTH, height)
        window.run(NUMBERS)
        return small(window.picture())


def small(png: bytes, colours: int = COLOURS, width: int = 0) -> bytes:
    """Return a picture with few colours, which has a quarter of the bytes.

    A picture that is wider than `width` pixels is scaled down; 0 keeps its size.
    """
    with Image.open(io.BytesIO(png)) as original:
        picture = original.convert("RGB")
    if 0 < width < picture.width:
        picture = picture.resize((width, round(picture.height * width / picture.width)))
    # This method also keeps rare colours, for example that of a badge.
    method = Image.Quantize.MAXCOVERAGE
    quantized = picture.quantize(colours, method, dither=Image.Dither.NONE)
    stream = io.BytesIO()
    quantized.save(stream, format="PNG", optimize=True)
    return stream.getvalue()


def write_screenshots(page: Path) -> None:
    """Write the opening picture and the first page of a report to docs/images.

    Without a report or a browser, prints what is missing and leaves the screenshot unchanged.
    """
    opening_file = page.parent / Paths().opening.relative_to(Paths().report.parent)
    opening = opening_file.with_suffix(".png")
    if opening.is_file():
        write_picture("opening", small(opening.read_bytes(), OPENING_COLOURS, OPENING_WIDTH))
    install_commands = missing()
    if not page.is_file():
        print(f"screenshots: unchanged, there is no {page}")
    elif install_commands:
        print(f"screenshots: unchanged, not installed: {install_commands}")
    else:
        write_picture("report", screenshot(page))
    check_size()


def write_picture(name: str, png: bytes) -> None:
    """Write a picture to docs/images if it has changed."""
    if write_if_changed(IMAGES / f"{name}.png", png):
        print(f"wrote docs/images/{name}.png ({len(png) / 1000:.0f} kB)")


def check_size() -> None:
    """End the program if the pictures of the documentation are too large together."""
    size = sum(file.stat().st_size for file in IMAGES.iterdir())
    if size > MAX_BYTES:
        sys.exit(f"docs/images: {size / 1000:.0f} kB, more than {MAX_BYTES / 1000:.0f}")


def main() -> None:
    """Write the screenshots of a report."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--report", type=Path, default=Paths().report.parent)
    write_screenshots(options.parse_args().report / Paths().report.name)


if __name__ == "__main__":
    main()
