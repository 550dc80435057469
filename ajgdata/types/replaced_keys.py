"""Keys of older versions that were replaced, and the line to write instead."""

from __future__ import annotations

from collections.abc import Sequence

#: Class of the settings that contained `channel`.
AUDIO_MODEL = "AudioSettings"
#: Class of a file of variants, and its keys of earlier versions.
VARIANTS_MODEL = "Variants"
VARIANTS_KEYS = {"why": "hypotheses", "grid": "vary, axis and panel"}


def replacement(place: Sequence[int | str], value: object, model: str) -> tuple[str, str] | None:
    """Return problem and fix for a key that was replaced; None for every other unknown key.

    `place` are the keys that lead to the value, as pydantic reports them, and `model` is the class
    that was read. `channel` belongs to the audio settings, which are read alone (of a trained
    model) or below `audio` (of a data set).
    """
    key = place[-1] if place else ""
    parents = () if model == AUDIO_MODEL else ("audio",)
    if key == "channel" and tuple(place[:-1]) == parents:
        name = ".".join(str(part) for part in place)
        problem = f"{name} was replaced by {name.replace('channel', 'microphone')}"
        return f"{problem}, which counts from 1", _microphone_fix(value)
    if model == VARIANTS_MODEL and key in VARIANTS_KEYS:
        return f"{key} was replaced by {VARIANTS_KEYS[key]}", "write it as in docs/variants.md"
    if key == "input_channel":
        line = f"`input_channel: {_plain(value)}` by `microphone: {_plain(value)}`"
        return "input_channel was replaced by microphone", f"replace {line}"
    return None


def microphone_of(channel: object) -> int | str | None:
    """Return the value of `microphone` for a value of the old key `channel`, which counted from 0.

    Raises ValueError for a value that the old key did not have.
    """
    if channel == "mono":
        return None
    if channel == "mean":
        return "mean"
    if type(channel) is int and channel >= 0:  # True is an int, too
        return channel + 1
    raise ValueError(f"{channel!r} is not a channel")


def _microphone_fix(channel: object) -> str:
    """Return the instruction with the line to copy."""
    old = f"`channel: {_plain(channel)}`"
    try:
        microphone = microphone_of(channel)
    except ValueError:
        return f"replace {old} by `microphone: N`, with the number of the microphone or mean"
    if microphone is None:
        return f"delete {old}: a data set without microphone has files with one channel"
    return f"replace {old} by `microphone: {microphone}`"


def _plain(value: object) -> str:
    """Return a value as YAML writes it."""
    if value is None:
        return "null"
    return str(value).lower() if isinstance(value, bool) else str(value)
