"""Write a small ONNX network for the feature `embedding`, and compute the feature of a sound.

The output of this network is the level in each of ten parts of a second. A trained network of your
own has the same form: its first input is (1, samples), and its first output is a vector.
"""

import hashlib
from pathlib import Path

import numpy as np
import onnx
from onnx import helper

from ajgdata.features.compute import FeatureComputer
from ajgdata.types import AudioSettings
from ajgdata.types.features import EmbeddingSettings

RATE_HZ = 44_100
PARTS = 10

number = onnx.TensorProto.FLOAT
shape = onnx.numpy_helper.from_array(np.array([1, PARTS, RATE_HZ // PARTS]), "shape")
graph = helper.make_graph(
    [
        helper.make_node("Reshape", ["samples", "shape"], ["parts"]),
        helper.make_node("ReduceL2", ["parts"], ["level"], axes=[2], keepdims=0),
    ],
    "levels",
    [helper.make_tensor_value_info("samples", number, [1, RATE_HZ])],
    [helper.make_tensor_value_info("level", number, [1, PARTS])],
    [shape],
)
model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
content = model.SerializeToString()
Path("levels.onnx").write_bytes(content)

settings = EmbeddingSettings(file="levels.onnx", sha256=hashlib.sha256(content).hexdigest())
print(f"features: {{kind: embedding, file: levels.onnx, sha256: {settings.sha256}}}")

compute = FeatureComputer(AudioSettings(sample_rate_hz=RATE_HZ), settings)
sound = np.linspace(1, 0, RATE_HZ, dtype=np.float32)
levels = compute(sound).values  # (10,), the level falls
