#!/usr/bin/env python3
"""Use a model exported by `ajgdata export --to numpy`: this file, the .npz and NumPy are enough.

    python ajgdata_numpy.py MODEL.npz RECORDING.wav ...     one line of JSON each

    import ajgdata_numpy
    model = ajgdata_numpy.load("MODEL.npz")     # runs the model's self-test
    model.predict(waveform, sample_rate_hz)     # (n,), full scale +-1

Made for Python 3.7 and NumPy 1.20 and later. It imports nothing of ajgdata: it is copied beside
each model. What the steps mean stands in ajgdata/export/layers.py.
"""

from __future__ import annotations

import json
import math
import struct
import sys
import zipfile
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

FORMAT = 1
METADATA = "ajgdata"  # key under which an ONNX file holds `about`
TOO_QUIET = 1e-30  # as ajgdata.features.checks
TINIEST = 1e-12  # as ajgdata.evaluate.calibration
VERDICTS = ("known", "nothing", "unknown", "not checked")
LARGEST = 2**31  # bytes of all arrays: a file that unpacks to more is no model
FRAMES = 64  # transformed at once: a long recording takes no more memory than a short one


def _compress(x, arrays, numbers):
    return np.arcsinh(x / arrays["scale"])


def _standardise(x, arrays, numbers):
    x = x[:, np.newaxis] if arrays["mean"].ndim == 2 else x  # (n, channels, n_features)
    return (x - arrays["mean"]) / arrays["std"]


def _normalise(x, arrays, numbers):
    norm = np.sqrt((x * x).sum(1, keepdims=True))
    return x / np.where(norm > 0, norm, 1)


def _convolve(x, arrays, numbers):
    weight, bias = arrays["weight"], arrays["bias"]  # (c_out, c_in, k), (c_out,)
    x = x[:, np.newaxis] if x.ndim == 2 else x  # (n, c_in, length)
    half = weight.shape[2] // 2
    x = np.pad(x, ((0, 0), (0, 0), (half, half)))
    parts = sliding_window_view(x, weight.shape[2], axis=2)[:, :, :: int(numbers["stride"])]
    parts = parts.transpose(0, 2, 1, 3).reshape(len(x), parts.shape[2], -1)
    y = parts @ weight.reshape(len(weight), -1).T + bias  # (n, length, c_out)
    return y.transpose(0, 2, 1)


def _relu(x, arrays, numbers):
    return np.maximum(x, 0)


def _dense(x, arrays, numbers):
    return x.reshape(len(x), -1) @ arrays["weight"].T + arrays["bias"]


def _squared_distances(x, rows):
    """Return |x - row|^2 (n, rows)."""
    products = x @ rows.T
    squares = (x * x).sum(1)[:, np.newaxis] + (rows * rows).sum(1)
    return np.maximum(squares - 2 * products, 0)


def _absolute_distances(x, rows):
    """Return the sum of |x - row| (n, rows)."""
    return np.array([np.abs(one - rows).sum(1) for one in x]).reshape(len(x), len(rows))


def _neighbours(x, arrays, numbers):
    far = _squared_distances if numbers.get("power", 2) == 2 else _absolute_distances
    distances = far(x, arrays["row"])
    nearest = np.argsort(distances, axis=1, kind="stable")[:, : int(numbers["k"])]
    return arrays["value"][nearest].mean(1)


def _kernel(x, arrays, numbers):
    return np.exp(-numbers["gamma"] * _squared_distances(x, arrays["row"]))


def _vote(x, arrays, numbers):
    wins = (x > 0).astype(x.dtype)
    return wins @ arrays["first"] + (1 - wins) @ arrays["second"]


def _trees(x, arrays, numbers):
    node = np.tile(arrays["root"], (len(x), 1))  # (n, trees)
    for _ in range(int(numbers["depth"])):
        below = np.take_along_axis(x, arrays["feature"][node], 1) <= arrays["threshold"][node]
        node = np.where(below, arrays["left"][node], arrays["right"][node])
    return arrays["value"][node].reshape(len(x), -1, int(numbers["outputs"])).sum(1)


def _softmax(x, arrays=None, numbers=None):
    powers = np.exp(x - x.max(1, keepdims=True))
    return powers / powers.sum(1, keepdims=True)


def _cast(x, arrays, numbers):
    return x.astype(np.float32 if numbers["bits"] == 32 else np.float64)


def _turn(x, arrays, numbers):
    turns = np.arctan2(x[:, :1], x[:, 1:]) / (2 * np.pi)
    return turns % 1.0 % 1.0 * numbers["period"]


STEPS = {
    "cast": _cast,
    "compress": _compress,
    "standardise": _standardise,
    "normalise": _normalise,
    "convolve": _convolve,
    "relu": _relu,
    "dense": _dense,
    "neighbours": _neighbours,
    "kernel": _kernel,
    "vote": _vote,
    "trees": _trees,
    "softmax": _softmax,
    "turn": _turn,
}


class Model:
    """An exported model. `about` says what it is: classes, unit, sample rate, provenance, ..."""

    def __init__(self, about, arrays):
        if about.get("format") != FORMAT:
            raise ValueError(f"of format {about.get('format')}, this program reads {FORMAT}")
        self.about, self.arrays = about, arrays
        self.sample_rate_hz = about["sample_rate_hz"]
        self.classes = about["classes"]

    def feature(self, waveform):
        """Return the feature (n_bins,), float32, of samples (n,)."""
        settings, window = self.about["features"], self.arrays["window"]
        samples = self._checked(waveform)
        exponent = math.frexp(float(np.abs(samples).max()))[1]
        samples = np.ldexp(samples.astype(np.float64), -exponent).astype(np.float32)
        frames = sliding_window_view(samples, len(window))[:: settings["hop"]]
        power, root = (settings["quantity"] == one for one in ("power", "root_power"))
        total = np.zeros(len(window) // 2 + 1)
        for start in range(0, len(frames), FRAMES):
            part = np.abs(np.fft.rfft(frames[start : start + FRAMES] * window)).astype(np.float64)
            total += (part**2 if power or root else part).sum(0)
        total = np.sqrt(total) if root else total
        first, last = self.about["bins"]
        total = total[first:last]
        if settings["normalisation"] == "none":
            return np.ldexp(total, exponent * (2 if power else 1)).astype(np.float32)
        order = {"l1": 1, "l2": 2, "max": np.inf}[settings["normalisation"]]
        norm = np.linalg.norm(total, order)
        return (total / (norm or 1.0)).astype(np.float32)

    def score(self, features):
        """Return the model's own output (n, n_outputs), before calibration."""
        return self._run(np.asarray(features, np.float32), self.about["layers"])

    def predict(self, waveform, sample_rate_hz):
        """Return what the model says of one recording (n,), as a dict.

        Raises ValueError for another sample rate and for a recording that cannot be used.
        """
        if sample_rate_hz != self.sample_rate_hz:
            raise ValueError(
                f"sampled at {sample_rate_hz} Hz, the model needs {self.sample_rate_hz} Hz"
            )
        return self.of_feature(self.feature(waveform))

    def of_feature(self, feature):
        """Return what `predict` does, of a feature (n_bins,)."""
        features = np.asarray(feature, np.float32)[np.newaxis]
        score, calibration = self.score(features), self.about["calibration"]
        novelty, verdict = self._guard(features)
        said = {"verdict": verdict, "novelty": novelty, "probability": {}, "interval": None}
        if not self.classes:
            value = float(score[0, 0])
            said.update(value=value, score=[value])
            half = calibration["half_width"]
            said["interval"] = None if half is None else [value - half, value + half]
            return said
        said.update(value=self.classes[int(score[0].argmax())], score=score[0].tolist())
        if self.about["probabilities"]:
            logs = np.log(np.maximum(score, TINIEST))
            scaled = _softmax(logs / calibration["temperature"])[0].tolist()
            said["probability"] = dict(zip(self.classes, scaled))  # noqa: B905 (Python 3.7)
        return said

    def check_self(self):
        """Raise ValueError if the model does not say of its test sound what it did when made."""
        feature = self.feature(test_sound(self.about["self_test"]))
        check_said(self.about, {"feature": feature, **self.of_feature(feature)})

    def _checked(self, waveform):
        samples, window = np.asarray(waveform), self.about["features"]["window"]
        if samples.ndim != 1:
            raise ValueError(f"need samples of shape (n,), got {samples.shape}")
        if len(samples) < window:
            raise ValueError(f"{len(samples)} samples are fewer than one window of {window}")
        if not np.isfinite(samples).all():
            raise ValueError("the samples hold NaN or infinity")
        peak = float(np.abs(samples).max())
        if peak < TOO_QUIET:
            raise ValueError("every sample is zero" if peak == 0 else f"too quiet: peak {peak:.2g}")
        if (samples == samples[0]).all():
            raise ValueError(f"every sample is {float(samples[0]):.4g}: no sound, only an offset")
        return samples

    def _run(self, x, layers):
        for layer in layers:
            arrays = {name: self.arrays[place] for name, place in layer["arrays"].items()}
            if layer["op"] == "join":
                x = np.concatenate([self._run(x, branch) for branch in layer["branches"]], axis=1)
            else:
                x = STEPS[layer["op"]](x, arrays, layer["numbers"])
        return x

    def _guard(self, features):
        """Return novelty and verdict of features (1, n_bins); novelty is None if not checked."""
        if "guard.grasps" not in self.arrays:
            return None, VERDICTS[3]
        of = {name: self.arrays["guard." + name].astype(np.float64) for name in GUARD}
        z = (np.arcsinh(features / of["scale"]) - of["mean"]) / of["std"]
        near = math.sqrt(_squared_distances(z, of["grasps"]).min())
        threshold = self.about["calibration"]["novelty_threshold"]
        novelty = near / threshold if threshold else None
        empty = _squared_distances(z, of["references"]).min(initial=np.inf)
        if math.sqrt(empty) < near:
            return novelty, VERDICTS[1]
        if novelty is None:
            return None, VERDICTS[3]
        return novelty, VERDICTS[2 if novelty > 1 else 0]


def check_said(about, said):
    """Raise ValueError unless what a model said of its test sound is what is expected."""
    test = about["self_test"]
    for name, expected in test["expected"].items():
        got = list(said[name].values()) if name == "probability" else said[name]
        error = largest_difference(got, expected, about["period"], name)
        if not error <= test["tolerance"][name]:
            raise ValueError(f"its self-test fails: {name} differs by {error:.2g}")


def largest_difference(one, other, period=None, name="score"):
    """Return the largest of |one - other|, the shortest way round for scores with a period."""
    error = np.abs(np.subtract(one, other))
    if period and name == "score":
        error = np.minimum(error, np.abs(period - error))
    return float(error.max(initial=0))


GUARD = ("grasps", "references", "mean", "std", "scale")


def test_sound(recipe):
    """Return the waveform (n,) of a self-test: exact in whole numbers, the same everywhere."""
    i = np.arange(recipe["samples"], dtype=np.int64)
    modulus = recipe["modulus"]
    return (2.0 * (recipe["multiplier"] * i * i % modulus) / modulus - 1).astype(np.float32)


def load(path):
    """Return the model in an .npz file, its self-test passed. Raises ValueError otherwise."""
    try:
        with zipfile.ZipFile(path) as file:
            size = sum(one.file_size for one in file.infolist())
        if size > LARGEST:
            raise ValueError(f"unpacks to {size} bytes, more than {LARGEST}")
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        model = Model(json.loads(arrays.pop("about").tobytes().decode("utf-8")), arrays)
        model.check_self()
    except (OSError, ValueError):
        raise
    except Exception as error:  # whatever is wrong with what is in it
        kind = type(error).__name__
        raise ValueError(f"damaged, or no exported model ({kind}: {error})") from None
    return model


def read_wav(path, channel="mono"):
    """Return samples (n,), float32, full scale +-1, and the rate of a WAV file.

    `channel` is a number, or `mean`; `mono` refuses more than one.
    """
    layout, sound = _chunks(Path(path).read_bytes())
    if len(layout) < 16 or not sound:
        raise ValueError("holds no samples")
    tag, count, rate, _, frame, bits = struct.unpack_from("<HHIIHH", layout)
    if not count or 8 * frame != count * bits:  # as 12 bits in 16, or 24 in 32
        raise ValueError(f"{count} channels of {bits} bits in {frame} bytes are not known")
    tag = struct.unpack_from("<H", layout, 24)[0] if tag == 0xFFFE and len(layout) > 25 else tag
    samples = _decoded(sound, tag, bits).reshape(-1, count)
    if channel == "mono" and count != 1:
        raise ValueError(f"has {count} channels, the model needs one")
    if channel == "mean":
        return samples.mean(1), rate
    if channel != "mono" and channel >= count:
        raise ValueError(f"has {count} channels (0 to {count - 1}), the model needs {channel}")
    return samples[:, 0 if channel == "mono" else channel], rate


def _chunks(content):
    """Return the chunks `fmt ` and `data` of the bytes of a WAV file."""
    if content[:4] != b"RIFF" or content[8:12] != b"WAVE":
        raise ValueError("no WAV file")
    at, layout = 12, b""
    while at + 8 <= len(content):
        name, size = struct.unpack_from("<4sI", content, at)
        part = content[at + 8 : at + 8 + size]
        if name == b"fmt ":
            layout = part
        elif name == b"data":
            if len(part) < size:
                raise ValueError("the file is cut short")
            return layout, part
        at += 8 + size + size % 2
    return layout, b""


def _decoded(sound, tag, bits):
    """Return samples (n,), float32, of the bytes of a WAV file."""
    width = bits // 8
    if tag == 3 and width in (4, 8):
        return np.frombuffer(sound, f"<f{width}").astype(np.float32)
    if tag != 1 or width not in (1, 2, 3, 4):
        raise ValueError(f"its encoding {tag} of {bits} bits is not known")
    if width == 1:  # the only one without a sign
        whole = np.frombuffer(sound, np.uint8).astype(np.int32) - 128
    else:  # each sample at the top of 32 bits: its sign is then in place
        padded = np.zeros((len(sound) // width, 4), np.uint8)
        padded[:, 4 - width :] = np.frombuffer(sound, np.uint8).reshape(-1, width)
        whole = padded.view("<i4")[:, 0] >> 8 * (4 - width)
    return (whole / 2.0 ** (8 * width - 1)).astype(np.float32)


def main(arguments):
    """Print a line of JSON for each recording; return 1 if one could not be used."""
    with_feature = "--feature" in arguments
    path, *recordings = [one for one in arguments if one != "--feature"]
    failed = 0
    try:
        model = load(path)
    except (OSError, ValueError) as error:
        print(f"error {path}: {error}", file=sys.stderr)
        return 2
    for recording in recordings:
        try:
            samples, rate = read_wav(recording, model.about["channel"])
            said = model.predict(samples, rate)
            if with_feature:
                said["feature"] = model.feature(samples).tolist()
            print(json.dumps({"file": recording, **said}))
        except (OSError, ValueError) as error:
            print(json.dumps({"file": recording, "error": str(error)}))
            failed = 1
    return failed


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1:]))
