"""Output of a network in a local ONNX file, for samples as they are.

The network gets the first `length_s` seconds, float32 (channels, n), with full scale ±1; (1, n) if
the data set has one microphone. Its first output has one value per component, (d,) or (1, d).
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.features.compute import FeatureInput
from ajgdata.store.audio import file_sha256, resample
from ajgdata.store.feature_array import Axis, FeatureArray
from ajgdata.types import DataError
from ajgdata.types.features import EmbeddingSettings

COMPONENT = "component"
_ATTRS = {"units": "1", "long_name": "number of the output of the network"}


def embeddings(sound: FeatureInput, settings: EmbeddingSettings) -> FeatureArray:
    """Return the output (component,) of the network.

    Raises DataError for a missing file, and ValueError for a file that is changed or not a network,
    and for an input or an output of another shape.
    """
    samples = sound.samples[:, : settings.least_samples(sound.sample_rate_hz)]
    rate_hz = settings.sample_rate_hz or sound.sample_rate_hz
    if rate_hz != sound.sample_rate_hz:
        samples = resample(samples, sound.sample_rate_hz, rate_hz)
    network = _network(settings.file, settings.sha256)
    name = network.get_inputs()[0].name
    try:
        output = np.asarray(network.run(None, {name: samples.astype(np.float32)})[0])
    except Exception as error:  # onnxruntime has many types of errors
        reason = str(error).splitlines()[0]
        raise ValueError(
            f"{Path(settings.file).name} does not accept samples {samples.shape}: {reason}"
        ) from None
    if output.size != output.shape[-1] or output.ndim not in (1, 2):
        raise ValueError(
            f"the output of {Path(settings.file).name} is {output.shape}, not a vector"
        )
    values = output.reshape(-1)
    components = np.arange(len(values), dtype=np.int32)
    return FeatureArray(values, (Axis(COMPONENT, components, _ATTRS),))


@lru_cache(maxsize=2)
def _network(file: str, sha256: str) -> Any:
    """Return the network in a file.

    Raises DataError if there is no file, and ValueError if it is not the file with this checksum.
    """
    import onnxruntime  # an optional dependency

    if not Path(file).is_file():
        raise DataError(file, "does not exist", f"copy the network with the sha256 {sha256} there")
    digest = file_sha256(Path(file))
    if digest != sha256:
        raise ValueError(f"{file} has the sha256 {digest}, not that of features.sha256")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1  # the result does not depend on the number of cores
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(
            file, sess_options=options, providers=["CPUExecutionProvider"]
        )
    except Exception as error:  # onnxruntime has many types of errors
        reason = str(error).splitlines()[0]
        raise ValueError(f"{file} is not a network that ONNX Runtime reads: {reason}") from None
