"""Scenes and their impulse responses: each scene is solved once, whoever asks for it.

One file a response, named by its scene and the gripper's code, so that a file never goes stale and
whoever writes it writes the same bytes. The folder may be deleted at any time, and any file in it
may be lost, cut off or spoilt: what cannot be read is made again.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from ajgdata import gripper
from ajgdata.store.files import line_of, read_yaml, sha256_of, write_bytes
from ajgdata.store.locks import remove_stale
from ajgdata.store.provenance import layer_hash
from ajgdata.types import DataError, describe, location

log = logging.getLogger(__name__)
#: Room for about 45,000 responses of the default gripper, 7,000 where it holds no grains.
DEFAULT_LIMIT_MB = 500.0
LIMIT_VARIABLE = "AJGDATA_RESPONSES_MB"
#: Each subfolder has its share of the limit, so that a full store is not searched at each write.
SHARES = 16
SUFFIX = ".response"
#: First line of a file: its form, and the SHA-256 of all that follows.
FORM = "ajgdata-response-2"


class ResponseStore:
    """Folder of impulse responses, safe to share between processes.

    Holds at most `limit_mb` MB (default: the environment's AJGDATA_RESPONSES_MB, else 500; 0 keeps
    nothing); what was used least recently goes first. Where it cannot write it says so once and
    goes on without.
    """

    def __init__(self, folder: Path, limit_mb: float | None = None) -> None:
        self.folder = folder
        self.limit_bytes = int(1e6 * (_limit_mb() if limit_mb is None else limit_mb))
        self._code = layer_hash("gripper")
        self._told = False
        self.solved = 0  #: scenes that were simulated, since nothing was kept of them

    def solve(self, scene: gripper.Scene) -> gripper.ImpulseResponse:
        """Return the response of `scene`: the one that is kept, else simulated now and kept.

        Scenes that are the same by `gripper.canonical` share one. Raises gripper.SceneError.
        """
        scene = gripper.canonical(scene)
        known = self.read(scene)
        if known is None:
            known = gripper.simulate(scene)
            self.solved += 1
            self.write(scene, known)
        return known

    def path(self, scene: gripper.Scene) -> Path:
        """Return the file in which the response of `scene` is kept."""
        text = f"{gripper.scene_digest(gripper.canonical(scene))} {self._code}"
        key = sha256_of(text.encode())
        return self.folder / key[0] / f"{key}{SUFFIX}"

    def read(self, scene: gripper.Scene) -> gripper.ImpulseResponse | None:
        """Return the kept response of `scene`; None if there is none that can be read."""
        return read_response(self.path(scene))

    def write(self, scene: gripper.Scene, response: gripper.ImpulseResponse) -> None:
        """Keep `response`, unless the folder does not let us."""
        if not self.limit_bytes:
            return
        body = _encode(response)
        path = self.path(scene)
        try:
            write_bytes(path, _head(body) + b"\n" + body)
            self._evict(path)
        except OSError as error:
            if not self._told:
                reason = error.strerror
                log.warning("%s cannot be written (%s): no response is kept", self.folder, reason)
            self._told = True

    def _evict(self, newest: Path) -> None:
        """Remove the least recently used until the subfolder of `newest` keeps to its share.

        Another process that reads such a file has it open, or simulates again.
        """
        room = self.limit_bytes // SHARES
        held = []
        remove_stale(newest.parent)
        with os.scandir(newest.parent) as entries:
            for entry in entries:
                if entry.name.startswith("."):  # of another writer
                    continue
                try:
                    stat = entry.stat()
                except FileNotFoundError:  # another process removed it, or gave it its name
                    continue
                held.append((entry.name != newest.name, -stat.st_mtime_ns, entry.path, stat))
        for others, _, path, stat in sorted(held, key=lambda one: one[:3]):
            room -= stat.st_size
            if others and room < 0:
                Path(path).unlink(missing_ok=True)


def read_response(path: Path) -> gripper.ImpulseResponse | None:
    """Return the response that is kept in a file, which is noted as used now; None if there is none
    that can be read."""
    try:
        content = path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        log.warning("%s cannot be read (%s): simulated again", path, error.strerror)
        return None
    head, _, body = content.partition(b"\n")
    if head != _head(body):
        log.warning("%s is damaged: simulated again and replaced", path)
        return None
    with contextlib.suppress(OSError):
        os.utime(path)  # used now; times of reading are often not kept by the file system
    return _decode(body)


def _limit_mb() -> float:
    given = os.environ.get(LIMIT_VARIABLE, str(DEFAULT_LIMIT_MB))
    try:
        limit = float(given)
    except ValueError:
        limit = -1.0
    if not 0 <= limit < float("inf"):
        raise DataError(LIMIT_VARIABLE, f"= {given!r}", "set a number of megabytes, 0 for none")
    return limit


def _head(body: bytes) -> bytes:
    return f"{FORM} {sha256_of(body)}".encode()


def _encode(response: gripper.ImpulseResponse) -> bytes:
    """Return a line of JSON, then samples and gain from outside as little-endian float64."""
    outside = np.zeros(0) if response.outside is None else response.outside
    about = {**vars(response), "samples": len(response.samples), "outside": len(outside)}
    text = json.dumps(about, sort_keys=True, allow_nan=False)
    values = np.concatenate([response.samples, outside])
    return text.encode() + b"\n" + values.astype("<f8").tobytes()


def _decode(body: bytes) -> gripper.ImpulseResponse:
    head, _, rest = body.partition(b"\n")
    about = json.loads(head)
    values = np.frombuffer(rest, dtype="<f8").astype(np.float64)
    samples, outside = np.split(values, [about["samples"]])
    return gripper.ImpulseResponse(
        **{**about, "samples": samples, "outside": outside if about["outside"] else None}
    )


def read_scene(path: Path) -> gripper.Scene:
    """Return the scene in a YAML or JSON file. Raises DataError with file, line, key and fix."""
    content = read_yaml(path)
    try:
        return gripper.Scene.model_validate(content)
    except ValidationError as error:
        line = line_of(path, location(error))
        raise describe(error, f"{path}:{line}") from None
