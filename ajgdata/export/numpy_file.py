"""An exported model for NumPy alone: one .npz without pickle, and the program that reads it."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np

from ajgdata.export import numpy_runtime
from ajgdata.export.description import Exported, in_numpy


def numpy_bytes(exported: Exported) -> bytes:
    """Return the .npz: arrays by name, and `about` as JSON in bytes."""
    model = in_numpy(exported)
    text = json.dumps(model.about, sort_keys=True, allow_nan=False)
    about = np.frombuffer(text.encode(), np.uint8)
    content = io.BytesIO()
    np.savez_compressed(content, about=about, **model.arrays)
    return content.getvalue()


def program_bytes() -> bytes:
    """Return the program that uses such a file: it needs nothing but NumPy."""
    return Path(numpy_runtime.__file__).read_bytes()
