"""`ajgdata device`: sound cards listed and checked."""

from __future__ import annotations

from collections.abc import Callable

from ajgdata.acquire.card import CardSettings
from ajgdata.acquire.card_check import DRIFT_S, CardCheck, check_card
from ajgdata.acquire.line import list_devices, open_card
from ajgdata.types import DataError

NO_DEVICE = DataError(
    "PortAudio",
    "finds no sound card",
    "plug one in",
)


def listed() -> list[str]:
    """Return a line for each device: name, channels, rates, API. Raises DataError if there is
    none."""
    found = list_devices()
    if not found:
        raise NO_DEVICE
    width = max(len(one["name"]) for one in found)
    return [
        f"{one['name']:{width}}  {one['inputs']:3} in {one['outputs']:3} out  "
        f"{' '.join(map(str, one['rates_hz'])) or 'no usual rate'} Hz  {one['api']}"
        for one in found
    ]


def check_device(
    settings: CardSettings,
    *,
    drift_s: float = DRIFT_S,
    progress: Callable[[str], object] = lambda _: None,
) -> CardCheck:
    """Check a sound card. Raises CardError."""
    with open_card(settings) as card:
        return check_card(card, drift_s, progress)
