"""Replaced keys of older versions, and the lines to write instead."""

from __future__ import annotations

from collections.abc import Sequence

from ajgdata.types.documentation import documentation

#: Class of the settings that contained `channel`.
AUDIO_MODEL = "AudioSettings"
#: Class of a file of variants, and its keys of earlier versions.
VARIANTS_MODEL = "Variants"
VARIANTS_KEYS = {"why": "hypotheses", "grid": "vary, axis and panel"}


def replacement(place: Sequence[int | str], value: object, model: str) -> tuple[str, str] | None:
    """Return problem and fix for a key that was replaced; None for every other unknown key.

    `place` are the keys that lead to the value, as pydantic reports them, and `model` is the name
    of the class that was read. The key `channel` was in the audio settings: at the top of their
    class (in a trained model), or below `audio` (in dataset.yaml).
    """
    key = place[-1] if place else ""
    parents = () if model == AUDIO_MODEL else ("audio",)
    if key == "channel" and tuple(place[:-1]) == parents:
        name = ".".join(str(part) for part in place)
        new_name = name.replace("channel", "microphone")
        problem = f"{name} was replaced by {new_name}, which counts from 1"
        return problem, _microphone_fix(value)
    if model == VARIANTS_MODEL and key in VARIANTS_KEYS:
        fix = f"write it as in {documentation('variants')}"
        return f"{key} was replaced by {VARIANTS_KEYS[key]}", fix
    if key == "input_channel":
        text = _yaml_text(value)
        fix = f"replace `input_channel: {text}` by `microphone: {text}`"
        return "input_channel was replaced by microphone", fix
    return None


def microphone_of(channel: object) -> int | str | None:
    """Return the value of `microphone` for a value of the old key `channel`, which counted from 0.

    Raises ValueError for a value that the old key did not have.
    """
    if channel == "mono":
        return None
    if channel == "mean":
        return "mean"
    if type(channel) is int and channel >= 0:  # isinstance would accept True
        return channel + 1
    raise ValueError(f"{channel!r} is not a channel")


def _microphone_fix(channel: object) -> str:
    """Return the instruction how to replace the key `channel`, with the new line."""
    old = f"`channel: {_yaml_text(channel)}`"
    try:
        microphone = microphone_of(channel)
    except ValueError:
        return f"replace {old} by `microphone: N`, with the number of the microphone or mean"
    if microphone is None:
        return f"delete {old}: a data set without microphone has files with one channel"
    return f"replace {old} by `microphone: {microphone}`"


def _yaml_text(value: object) -> str:
    """Return a value as YAML writes it."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    return str(value)
