"""Cache of impulse responses, so that each scene is simulated once.

There is one file per scene. Its name depends on the scene and on the code of the gripper, so a file
is never outdated. You can delete the folder at any time.
"""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

import numpy as np

from ajgdata import gripper
from ajgdata.store.code_hash import code_hash
from ajgdata.store.files import sha256_of, write_bytes

SUFFIX = ".npz"
_ARRAYS = ("samples", "outside")


class ResponseStore:
    """A folder of impulse responses, which several processes can use at the same time."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._code = code_hash("gripper")
        #: Number of scenes that were simulated, because they were not in the folder.
        self.solved = 0

    def solve(self, scene: gripper.Scene) -> gripper.ImpulseResponse:
        """Return the response of `scene`; if it is not in the folder, simulate and store it.

        Raises gripper.SceneError for a scene that is not possible.
        """
        path = self.path(scene)
        response = read_response(path)
        if response is None:
            response = gripper.simulate(scene)
            self.solved += 1
            self.write(scene, response)
        return response

    def path(self, scene: gripper.Scene) -> Path:
        """Return the file of the response of `scene`."""
        key = sha256_of(f"{gripper.scene_digest(scene)} {self._code}".encode())
        return self.folder / key[0] / f"{key}{SUFFIX}"

    def write(self, scene: gripper.Scene, response: gripper.ImpulseResponse) -> None:
        """Store the response of `scene`."""
        write_bytes(self.path(scene), _encode(response))


def read_response(path: Path) -> gripper.ImpulseResponse | None:
    """Return the response in a file; None if it is absent or damaged."""
    try:
        with path.open("rb") as stream, np.load(stream) as file:
            arrays = {key: file.get(key) for key in _ARRAYS}
            response = gripper.ImpulseResponse(**json.loads(str(file["about"])), **arrays)
    except (FileNotFoundError, EOFError, ValueError, LookupError, zipfile.BadZipFile):
        return None
    return response


def _encode(response: gripper.ImpulseResponse) -> bytes:
    """Return the content of a file: arrays, and all other attributes as JSON."""
    about = {key: value for key, value in vars(response).items() if key not in _ARRAYS}
    arrays = {key: getattr(response, key) for key in _ARRAYS}
    present = {key: value for key, value in arrays.items() if value is not None}
    stream = io.BytesIO()
    text = json.dumps(about, sort_keys=True, allow_nan=False)
    np.savez(stream, about=np.array(text), **present)
    return stream.getvalue()
