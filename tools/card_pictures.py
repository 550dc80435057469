"""`python -m tools.card_pictures`: a good and a bad check of a sound card into docs/images.

Both are of the virtual gripper on a cube; the bad one is too loud for its speaker, hums, and has
two clocks.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.signal import fftconvolve, resample_poly

from ajgdata.acquire.card import CardSettings, Heard
from ajgdata.acquire.card_check import check_card
from ajgdata.acquire.plant import noise_floor, scene_response
from ajgdata.acquire.sound_card import SoundCard
from ajgdata.gripper import Scene, SignalChain, simulate
from ajgdata.report.canvas import encode
from ajgdata.report.card_check import card_figure
from ajgdata.store.files import write_bytes
from tools.screenshots import small

IMAGES = Path(__file__).resolve().parents[1] / "docs/images"
LATENCY = 1_024
HUM = 4e-3  # of full scale
CUBIC = 0.3
FAST = 1  # hundred millionths


class Line:
    """A line (acquire.card.Line) through `response`, with or without the faults."""

    def __init__(self, response: NDArray[Any], noise: float, bad: bool) -> None:
        self._response, self._noise, self._bad = response, noise, bad
        self._random = np.random.default_rng(0)

    def play(self, sound: NDArray[np.float32], frames: int) -> Heard:
        """Play and record in no time."""
        played = sound - CUBIC * self._bad * sound**3
        heard = np.zeros(frames)
        part = fftconvolve(played, self._response)[: frames - LATENCY]
        heard[LATENCY : LATENCY + len(part)] = part
        if self._bad and len(sound) > 200_000:  # pulses of many seconds
            heard = resample_poly(heard, 10_000 + FAST, 10_000)[:frames]
        time = np.arange(frames) / 44_100
        hum = sum(np.sin(2 * np.pi * 50 * k * time) / k for k in (1, 2, 3))
        heard += HUM * self._bad * hum + self._noise * self._random.standard_normal(frames)
        return Heard(heard[:, np.newaxis].astype(np.float32))

    def describe(self) -> Mapping[str, Any]:
        """Return what a driver would say."""
        return {"api": "simulated"}

    def close(self) -> None:
        """Nothing is open."""


def _narrow(png: bytes) -> bytes:
    with Image.open(io.BytesIO(png)) as whole:
        part = whole.convert("RGB").resize((900, round(900 * whole.height / whole.width)))
    stream = io.BytesIO()
    part.save(stream, format="PNG")
    return stream.getvalue()


def main() -> None:
    """Write both pictures."""
    chain = SignalChain(gain_db=6.0)
    response = scene_response(simulate(Scene.model_validate({"object": "cube_20p7"})), chain)
    for name, bad in (("card-good", False), ("card-bad", True)):
        line = Line(response, noise_floor(chain), bad)
        check, heard = check_card(SoundCard(line, CardSettings(device="a card")), drift_s=10)
        figure = card_figure(check.summary(), heard.take, heard.delays, "simulated")
        png = small(_narrow(encode(figure, "png")))
        write_bytes(IMAGES / f"{name}.png", png)
        print(f"wrote docs/images/{name}.png ({len(png) / 1000:.0f} kB)")
        for one in check.verdict:
            print(f"  {one.level}: {one.said}; {one.fix}")


if __name__ == "__main__":
    main()
