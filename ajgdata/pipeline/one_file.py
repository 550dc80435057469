"""Write an existing report as one HTML file that people can send."""

from __future__ import annotations

import base64
import math
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote, unquote, urldefrag

from bs4 import BeautifulSoup

from ajgdata.paths import INDEX, Paths
from ajgdata.report.one_file import one_file
from ajgdata.store.audio import mp3_bytes, read_audio
from ajgdata.store.files import read_text, write_bytes
from ajgdata.types import AudioSettings, DataError, Segment

#: Largest size of the file. E-mail servers refuse larger attachments.
MAX_BYTES = 10_000_000
MEDIA_TYPES = {".png": "image/png"}
#: Letters of an SVG file that stay as they are in a data URI. The text is then 5 % longer, and a
#: third longer in base64.
SVG_LETTERS = " /:;,=()'[]{}*!@&?+$"
#: Sounds for people: one microphone, at a rate that MP3 has.
LISTENING = AudioSettings(sample_rate_hz=44_100, other_rate="resample", microphone=1)


class WrittenReport(NamedTuple):
    """A written file: its size in bytes, and the numbers of contained and omitted sounds."""

    n_bytes: int
    n_sounds: int
    n_omitted: int


def write_one_file(paths: Paths, file: Path) -> WrittenReport:
    """Write the report of a run with its pages, figures and sounds into one HTML file.

    Sounds are compressed (MP3, the first microphone). Sounds that would enlarge the file beyond
    `MAX_BYTES`, and sounds that no longer exist, are omitted.
    """
    folder = paths.report.parent
    pages = {name: read_text(folder / name, MAX_BYTES) for name in _page_names(folder)}

    def image(link: str) -> str:
        """Return an image of the report as data URI."""
        path = folder / unquote(link)
        if path.suffix == ".svg":
            return f"data:image/svg+xml,{quote(path.read_text(encoding='utf-8'), safe=SVG_LETTERS)}"
        return _data_uri(MEDIA_TYPES[path.suffix], path.read_bytes())

    empty_players = one_file(pages, image, sound=lambda link: "")
    remaining = MAX_BYTES - len(empty_players.html.encode())
    sounds: dict[str, str | None] = {}

    def sound(link: str) -> str | None:
        """Return a sound as data URI; None if it does not exist, or the file is full."""
        nonlocal remaining
        if link not in sounds:
            sounds[link] = _sound(folder, link)
        address = sounds[link]
        if address is None or len(address) > remaining:
            return None
        remaining -= len(address)
        return address

    report = one_file(pages, image, sound)
    content = report.html.encode()
    write_bytes(file, content)
    return WrittenReport(len(content), report.n_sounds, report.n_omitted)


def _page_names(folder: Path) -> list[str]:
    """Return the pages of a report that its navigation names, the first page first."""
    first = BeautifulSoup(read_text(folder / INDEX, MAX_BYTES), "html.parser")
    links = [str(link["href"]) for link in first.select("nav.site li a[href]")]
    return list(dict.fromkeys([INDEX, *links]))


def _sound(folder: Path, link: str) -> str | None:
    """Return the sound of a link such as `../data/a.wav#t=1.5,2` as MP3; None if it is missing."""
    address, fragment = urldefrag(link)
    start, _, end = fragment.removeprefix("t=").partition(",")
    segment = Segment(float(start or 0), float(end or math.inf))
    try:
        audio = read_audio(folder / unquote(address), LISTENING, segment)
    except (DataError, FileNotFoundError):
        return None
    return _data_uri("audio/mpeg", mp3_bytes(audio.samples, LISTENING.sample_rate_hz))


def _data_uri(media_type: str, content: bytes) -> str:
    return f"data:{media_type};base64,{base64.b64encode(content).decode()}"
