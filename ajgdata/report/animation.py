"""A film of the pressure field -> an animated GIF that needs nothing but an image viewer."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from scipy.ndimage import zoom

from ajgdata.gripper.pressure_slices import Film
from ajgdata.gripper.scene import Scene
from ajgdata.report.scenes import AIR, MEMBRANE, OBJECT, section

Real = NDArray[np.floating]
#: Width of the image whatever the gripper, and the height of the head with its words.
WIDTH_PX, HEAD_PX = 420, 24
#: Pressures from -1 to 1 take the palette's colours 0 to SHADES - 1; fixed colours follow them.
SHADES = 81
_FIXED = ("#ffffff", "#222222", MEMBRANE, OBJECT, "#b08b4f", "#6b6b6b", "#0072B2")
WHITE, INK, MEMBRANE_AT, OBJECT_AT, GRAINS_AT, GREY_AT, BLUE_AT = range(SHADES, SHADES + 7)


def palette() -> list[int]:
    """Return RGB values: blue (below rest) through air to red (above), then the fixed colours."""
    low, rest, high = (_rgb(colour) for colour in ("#08306b", AIR, "#7f0010"))
    share = np.linspace(-1, 1, SHADES)[:, None]
    ends = np.where(share < 0, low, high)
    shades = rest + np.abs(share) ** 0.8 * (ends - rest)
    return [*np.round(shades).astype(int).ravel().tolist(), *(v for c in _FIXED for v in _rgb(c))]


def _rgb(colour: str) -> NDArray[np.int_]:
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)])


def loudness(frames: Real) -> Real:
    """Return pressures of any shape as -1 to 1: asinh, so that echoes at -30 dB are still seen."""
    reference = float(np.quantile(np.abs(frames), 0.995)) or 1.0
    return np.clip(np.arcsinh(10 * frames / reference) / np.arcsinh(10), -1, 1)


def animate(scene: Scene, film: Film, frame_ms: int = 60) -> bytes:
    """Return the film (plane xz) as a GIF, the outline of the cavity of `scene` drawn over it.

    The same film gives the same bytes. Raises ValueError for a film of another plane.
    """
    if film.plane != "xz":
        raise ValueError(f"a film of the plane {film.plane} has no outline here: take xz")
    h = float(film.up_m[1] - film.up_m[0])
    corner = 1e3 * (film.across_m[0] - h / 2), 1e3 * (film.up_m[-1] + h / 2)
    scale = WIDTH_PX / (1e3 * h * len(film.across_m))
    height = round(WIDTH_PX / len(film.across_m) * len(film.up_m))
    back = _background(scene, (WIDTH_PX, height), corner, scale)
    images = []
    for pressure, seconds in zip(loudness(film.frames), film.times_s, strict=True):
        images.append(_frame(pressure, back, seconds))
    stream = io.BytesIO()
    images[0].save(
        stream,
        format="GIF",
        save_all=True,
        append_images=images[1:],
        duration=frame_ms,
        loop=0,
        optimize=False,
        disposal=1,
    )
    return stream.getvalue()


def _background(
    scene: Scene, size: tuple[int, int], corner: tuple[float, float], scale: float
) -> NDArray[np.uint8]:
    """Return what does not move, as palette indices (height, width): 0 where the wave is seen.

    `corner` is the upper left one, in mm, `scale` in pixels per mm.
    """
    cut = section(scene)
    image = Image.new("P", size, WHITE)
    draw = ImageDraw.Draw(image)

    def line(x: Real, z: Real) -> list[tuple[float, float]]:
        return [
            ((a - corner[0]) * scale, (corner[1] - b) * scale) for a, b in zip(x, z, strict=True)
        ]

    open_ = cut.roof > cut.floor
    x, floor, roof = cut.x[open_], cut.floor[open_], cut.roof[open_]
    if cut.table is not None:
        table = np.array([cut.table, cut.table])
        draw.line(line(np.array([-200.0, 200.0]), table), fill=GREY_AT, width=2)
        if np.any(cut.inside):
            under = cut.x[cut.inside]
            top, below = (line(under, side[cut.inside]) for side in (cut.top, cut.below))
            draw.polygon([*top, *reversed(below)], fill=OBJECT_AT)
    draw.polygon([*line(x, floor), *reversed(line(x, roof))], fill=0)
    if scene.medium.kind != "air":
        draw.line(line(x, cut.surface[open_]), fill=GRAINS_AT, width=2)
    draw.line(line(x, roof), fill=INK, width=4)
    draw.line(line(x, floor), fill=MEMBRANE_AT, width=3)
    for (across, _), colour in (
        (scene.gripper.speaker_mm, BLUE_AT),
        (scene.gripper.microphone_mm, INK),
    ):
        ((px, py),) = line(np.array([across]), np.array([scene.gripper.height_mm]))
        draw.ellipse((px - 5, py - 5, px + 5, py + 5), fill=colour)
    return np.asarray(image)


def _frame(pressure: Real, back: NDArray[np.uint8], seconds: float) -> Image.Image:
    """Return one image: the wave inside, what does not move around it, the time above."""
    height, width = back.shape
    rows, columns = pressure.shape
    # Rows of the field go up, rows of an image go down.
    smooth = zoom(
        pressure[::-1], (height / rows, width / columns), order=1, grid_mode=True, mode="nearest"
    )
    shade = np.round((np.clip(smooth, -1, 1) + 1) / 2 * (SHADES - 1)).astype(np.uint8)
    canvas = np.full((height + HEAD_PX, width), WHITE, np.uint8)
    canvas[HEAD_PX:] = np.where(back == 0, shade, back)
    image = Image.fromarray(canvas, mode="P")
    image.putpalette(palette())
    words = f"simulated   {1e3 * seconds:5.2f} ms"
    ImageDraw.Draw(image).text((8, 4), words, fill=INK, font=ImageFont.load_default(14))
    return image
