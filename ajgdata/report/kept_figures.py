"""Figures that were drawn before, kept by what they show and by the code that drew them."""

from __future__ import annotations

import hashlib
import io
import re
import sys
import zlib
from collections.abc import Mapping
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from zipfile import BadZipFile, ZipFile

import numpy as np

from ajgdata.paths import FIGURE_FORMATS
from ajgdata.report.blocks import Illustration
from ajgdata.store.files import write_bytes

#: What else a figure follows from.
PACKAGES = ("matplotlib", "fonttools", "numpy", "pillow", "scipy")
#: Figures that are kept: some reports' worth, a quarter of a megabyte each.
MOST = 1000
#: How Python writes an object that does not say what is in it.
_NAMELESS = re.compile(r" at 0x[0-9a-f]+>")


def made_of(*values: object) -> str:
    """Return a digest of plain values, records and arrays, each in full; "" if one of them does not
    say what is in it."""
    with np.printoptions(threshold=sys.maxsize, floatmode="unique"):
        text = repr(values)
    return "" if _NAMELESS.search(text) else hashlib.sha256(text.encode()).hexdigest()


class KeptFigures:
    """A folder of figures, one archive each; `code` is the digest of all code that may draw them.

    An archive checks its content: a spoilt one is as if it were not there.
    """

    def __init__(self, folder: Path, code: str) -> None:
        self.folder = folder
        self._base = (code, *(f"{name} {version(name)}" for name in PACKAGES))

    def read(self, one: Illustration) -> dict[str, bytes]:
        """Return the figure's files by suffix; none if it is not kept."""
        place = self._place(one)
        if place is None or not place.is_file():
            return {}
        try:
            with ZipFile(place) as archive:
                files = {suffix: archive.read(suffix) for suffix in FIGURE_FORMATS}
            place.touch()
        except (BadZipFile, LookupError, OSError, ValueError, zlib.error):
            return {}
        return files

    def keep(self, one: Illustration, files: Mapping[str, bytes]) -> None:
        """Keep the files of a figure that was drawn, by suffix."""
        if place := self._place(one):
            content = io.BytesIO()
            with ZipFile(content, "w") as archive:
                for suffix, data in files.items():
                    archive.writestr(suffix, data)
            write_bytes(place, content.getvalue())

    def tidy(self) -> None:
        """Remove what was not used for longest, beyond MOST figures."""
        used_s: dict[Path, float] = {}
        for file in self.folder.glob("*.zip"):
            with suppress(FileNotFoundError):  # another process tidies, too
                used_s[file] = file.stat().st_mtime
        for file in sorted(used_s, key=lambda one: -used_s[one])[MOST:]:
            file.unlink(missing_ok=True)

    def _place(self, one: Illustration) -> Path | None:
        if not (one.made_of and self._base[0]):
            return None
        return self.folder / f"{made_of(one.name, one.made_of, self._base)[:32]}.zip"
