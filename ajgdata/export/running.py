"""Exported models as others run them: in ONNX Runtime, and in a bare interpreter with NumPy."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.export import numpy_runtime
from ajgdata.export.numpy_file import program_bytes
from ajgdata.types import DataError

#: What is said of one recording: feature (n_bins,), score (n_outputs,), and what follows of it.
Said = dict[str, Any]
_AGAIN = "export it again"


class OnnxModel:
    """An ONNX file in ONNX Runtime, its self-test passed. `about` is what it says of itself."""

    def __init__(self, path: Path) -> None:
        """Raise DataError if the runtime is missing, and for a file that is damaged or not ours."""
        try:
            import onnxruntime
        except ImportError:
            fix = "pip install 'ajgdata[export]'"
            raise DataError("onnxruntime", "is not installed", fix) from None
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        options.log_severity_level = 4  # what is wrong is raised as well
        if not path.is_file():
            raise DataError(path, "there is no such file", "correct the name")
        try:
            self._session = onnxruntime.InferenceSession(
                path, options, providers=["CPUExecutionProvider"]
            )
        except Exception as error:  # the runtime's own types have no common one
            raise DataError(path, f"not a readable ONNX file ({_line(error)})", _AGAIN) from None
        said = self._session.get_modelmeta().custom_metadata_map
        try:
            self.about = json.loads(said[numpy_runtime.METADATA])
            known = self.about["format"] == numpy_runtime.FORMAT
        except (KeyError, ValueError, TypeError):
            raise DataError(path, "was not made by `ajgdata export`", _AGAIN) from None
        if not known:
            raise DataError(path, f"is of format {self.about['format']}", _AGAIN)
        self._outputs = [one.name for one in self._session.get_outputs()]
        self._check_self(path)

    def __call__(self, samples: np.ndarray) -> Said:
        """Return what the model says of samples (n,), as the NumPy program does."""
        got = self.outputs(samples)
        names = self.about["classes"]
        interval = None if names else [float(got["low"]), float(got["high"])]
        return {
            "feature": got["feature"],
            "score": got["score"],
            "value": names[int(got["class"])] if names else float(got["value"]),
            "probability": dict(zip(names, got.get("probability", ()), strict=False)),
            "interval": interval if interval and np.isfinite(interval).all() else None,
            "novelty": got.get("novelty"),
            "verdict": numpy_runtime.VERDICTS[got.get("verdict", 3)],
        }

    def outputs(self, samples: np.ndarray) -> Said:
        """Return the outputs of the graph for samples (n,), by name."""
        waveform = np.asarray(samples, np.float32)[np.newaxis]
        got = self._session.run(None, {"waveform": waveform})
        return {name: value[0] for name, value in zip(self._outputs, got, strict=True)}

    def _check_self(self, path: Path) -> None:
        try:
            said = self(numpy_runtime.test_sound(self.about["self_test"]))
            numpy_runtime.check_said(self.about, said)
        except ValueError as error:
            raise DataError(path, str(error), _AGAIN) from None
        except Exception as error:  # whatever is wrong with what is in it
            raise DataError(path, f"damaged ({_line(error)})", _AGAIN) from None


def numpy_about(path: Path) -> dict[str, Any]:
    """Return what an .npz file says of itself, its self-test passed. Raises DataError."""
    try:
        return numpy_runtime.load(path).about
    except FileNotFoundError:
        raise DataError(path, "there is no such file", "correct the name") from None
    except (OSError, ValueError) as error:
        raise DataError(path, f"not a readable model ({_line(error)})", _AGAIN) from None


def numpy_answers(program: Path, model: Path, files: Sequence[str]) -> Iterator[Said]:
    """Yield what the NumPy program says of WAV files: run as a person would, without this package.

    A file that it refuses yields {"error": ...}. Raises DataError when the program fails, and
    without running it where it is not this package's: it may have come from anywhere.
    """
    if not program.is_file():
        raise DataError(program, "there is no such file", _AGAIN)
    if program.read_bytes() != program_bytes():
        problem = "is not the program of this version of ajgdata, and is not run"
        raise DataError(program, problem, _AGAIN)
    for start in range(0, len(files), 64):  # a command line holds only so many names
        part = files[start : start + 64]
        command = [sys.executable, "-I", str(program), str(model), "--feature", *part]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        lines = done.stdout.splitlines()
        if done.returncode > 1 or len(lines) != len(part):
            said = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
            raise DataError(program, f"fails ({said})", _AGAIN)
        yield from (json.loads(line) for line in lines)


def _line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
