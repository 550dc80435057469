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

channels, rate = soundfile.read(recording, dtype="float32", always_2d=True)
if rate != about["sample_rate_hz"]:
    sys.exit(f"{recording}: sampled at {rate} Hz, the model needs {about['sample_rate_hz']} Hz")
count, microphone = channels.shape[1], about["microphone"]  # a number from 1, mean, or None
if microphone == "mean":
    samples = channels.mean(axis=1)
elif microphone is None and count > 1:
    sys.exit(f"{recording}: has {count} channels, the model needs one")
elif (microphone or 1) > count:
    sys.exit(f"{recording}: has {count} channel(s), the model needs microphone {microphone}")
else:
    samples = channels[:, (microphone or 1) - 1]
if len(samples) < about["features"]["window"]:
    sys.exit(f"{recording}: the model needs {about['features']['window']} samples")

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
