"""Use a model of `ajgdata export` with NumPy, SoundFile and ONNX Runtime alone.

python onnx_predict.py MODEL.onnx RECORDING.wav
"""

import json
import sys

import numpy as np
import onnxruntime
import soundfile

model, recording = sys.argv[1:]
session = onnxruntime.InferenceSession(model, providers=["CPUExecutionProvider"])
about = json.loads(session.get_modelmeta().custom_metadata_map["ajgdata"])

samples, rate = soundfile.read(recording, dtype="float32")
if rate != about["sample_rate_hz"]:
    sys.exit(f"{recording}: sampled at {rate} Hz, the model needs {about['sample_rate_hz']} Hz")
if samples.ndim != 1 or len(samples) < about["features"]["window"]:
    sys.exit(f"{recording}: the model needs one channel, {about['features']['window']} samples")

outputs = [output.name for output in session.get_outputs()]
said = dict(zip(outputs, session.run(None, {"waveform": samples[np.newaxis]}), strict=True))
if not said["usable"][0]:
    sys.exit(f"{recording}: silent, constant, or not finite")
if "verdict" in said:
    novelty = f"(novelty {said['novelty'][0]:.2f})" if "novelty" in said else ""
    print(about["verdicts"][said["verdict"][0]], novelty)
if not about["classes"]:
    print(f"{said['value'][0]:.4g} {about['unit']}, {said['low'][0]:.4g} to {said['high'][0]:.4g}")
elif "probability" in said:
    for number in np.argsort(-said["probability"][0])[:5]:
        print(f"{said['probability'][0][number]:7.2%} {about['classes'][number]}")
else:
    print(about["classes"][said["class"][0]])
