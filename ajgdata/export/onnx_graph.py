"""An exported model as one ONNX graph: waveform in, calibrated answer out.

Written node by node with operators of ONNX's own opset 20, so that any runtime that has these can
run it; nothing of torch's or scikit-learn's is converted. The transform is done in float64: ONNX
Runtime's float32 transform errs by 3e-5 where the window is no power of two.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from ajgdata.export.description import Exported
from ajgdata.export.layers import Layer
from ajgdata.export.numpy_runtime import METADATA, TINIEST, TOO_QUIET

OPSET = 20
IR_VERSION = 10  # the newest that runtimes of 2024 read
_TYPES = {32: TensorProto.FLOAT, 64: TensorProto.DOUBLE}


class _Graph:
    """Nodes and constants in the order in which they were added."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: list[onnx.TensorProto] = []
        self.double = False  #: whether the values of the model's steps are float64

    def __call__(self, op: str, *inputs: str, name: str = "", **attributes: Any) -> str:
        """Add a node; return the name of its output."""
        result = name or f"{op}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(op, inputs, [result], **attributes))
        return result

    def constant(self, value: Any, dtype: Any = np.float64) -> str:
        """Add a constant; return its name."""
        name = f"constant_{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.asarray(value, dtype), name))
        return name

    def number(self, value: Any) -> str:
        """Return a constant in the precision of the model's steps."""
        return self.constant(value, np.float64 if self.double else np.float32)

    def whole(self, *value: int) -> str:
        return self.constant(value, np.int64)

    def to(self, x: str, bits: int, name: str = "") -> str:
        return self("Cast", x, to=_TYPES[bits], name=name)

    def sum(self, x: str, axis: int, keepdims: int = 0) -> str:
        return self("ReduceSum", x, self.whole(axis), keepdims=keepdims)

    def unless_zero(self, x: str) -> str:
        """Return x, and 1 where it is 0: what can be divided by."""
        zero, one = self.constant(0.0), self.constant(1.0)
        return self("Where", self("Greater", x, zero), x, one)


def onnx_bytes(exported: Exported) -> bytes:
    """Return the ONNX file: `about` is in its metadata, as JSON under `ajgdata`."""
    graph = _Graph()
    about = exported.about
    peak = _peak(graph)
    _usable(graph, peak)
    feature = _feature(graph, peak, exported)
    outputs = [("usable", TensorProto.BOOL, []), ("feature", TensorProto.FLOAT, ["bins"])]
    score = graph.to(_steps(graph, feature, exported.layers), 64)
    graph.to(score, 32, name="score")
    outputs.append(("score", TensorProto.FLOAT, ["outputs"]))
    outputs += _answer(graph, score, about)
    outputs += _guard(graph, feature, exported)
    sizes = {"bins": about["bins"][1] - about["bins"][0], "outputs": about["outputs"]}
    model = helper.make_model(
        helper.make_graph(
            graph.nodes,
            "-".join(str(about[key]) for key in ("data_set", "task", "model")),
            [helper.make_tensor_value_info("waveform", TensorProto.FLOAT, ["batch", "samples"])],
            [
                helper.make_tensor_value_info(name, kind, ["batch", *(sizes[d] for d in shape)])
                for name, kind, shape in outputs
            ],
            graph.constants,
        ),
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="ajgdata",
        producer_version=str(about["provenance"].get("ajgdata_version", "")),
    )
    helper.set_model_props(model, {METADATA: json.dumps(about, sort_keys=True, allow_nan=False)})
    onnx.checker.check_model(model)
    return model.SerializeToString(deterministic=True)


def _peak(graph: _Graph) -> str:
    """Return the largest absolute sample (batch, 1), float64."""
    magnitude = graph.to(graph("Abs", "waveform"), 64)
    return graph("ReduceMax", magnitude, graph.whole(1), keepdims=1)


def _usable(graph: _Graph, peak: str) -> None:
    """Add `usable` (batch,): not silent, not constant, no NaN, no infinity."""
    loud = graph("GreaterOrEqual", peak, graph.constant(TOO_QUIET))
    finite = graph("Not", graph("IsInf", peak))
    high, low = (
        graph(op, "waveform", graph.whole(1), keepdims=1) for op in ("ReduceMax", "ReduceMin")
    )
    moves = graph("Greater", high, low)
    # ReduceMax may pass over NaN; a sum does not
    number = graph("Not", graph("IsNaN", graph.sum("waveform", 1, keepdims=1)))
    both = graph("And", graph("And", loud, finite), graph("And", moves, number))
    graph("Squeeze", both, graph.whole(1), name="usable")


def _feature(graph: _Graph, peak: str, exported: Exported) -> str:
    """Add `feature` (batch, n_bins), float32, as `features.spectrum` makes it."""
    settings = exported.about["features"]
    samples = graph("Div", graph.to("waveform", 64), graph.unless_zero(peak))
    parts = graph(
        "STFT",
        graph("Unsqueeze", samples, graph.whole(2)),  # (batch, n, 1)
        graph.constant(settings["hop"], np.int64),
        graph.constant(exported.window),
        graph.constant(settings["window"], np.int64),
        onesided=1,
    )  # -> (batch, frames, window/2 + 1, 2)
    power = graph.sum(graph("Mul", parts, parts), 3)
    quantity = graph("Sqrt", power) if settings["quantity"] == "magnitude" else power
    total = graph.sum(quantity, 1)
    if settings["quantity"] == "root_power":
        total = graph("Sqrt", total)
    first, last = exported.about["bins"]
    total = graph("Slice", total, graph.whole(first), graph.whole(last), graph.whole(1))
    norm = _norm(graph, total, settings["normalisation"])
    if norm is None:  # back to the amplitude that was played
        scale = graph("Mul", peak, peak) if settings["quantity"] == "power" else peak
        total = graph("Mul", total, scale)
    else:
        total = graph("Div", total, graph.unless_zero(norm))
    return graph.to(total, 32, name="feature")


def _norm(graph: _Graph, values: str, normalisation: str) -> str | None:
    """Return the norm (batch, 1) of values (batch, n_bins) that are not negative."""
    if normalisation == "none":
        return None
    op = {"l1": "ReduceL1", "l2": "ReduceL2", "max": "ReduceMax"}[normalisation]
    return graph(op, values, graph.whole(1), keepdims=1)


def _steps(graph: _Graph, x: str, layers: Sequence[Layer], double: bool = False) -> str:
    """Add the steps of a model; return the name of its output."""
    graph.double = double
    for layer in layers:
        if layer.op == "join":
            before = graph.double
            x = graph("Concat", *(_steps(graph, x, b, before) for b in layer.branches), axis=1)
        else:
            x = _STEPS[layer.op](graph, x, layer.arrays, layer.numbers)
    return x


Arrays = Mapping[str, np.ndarray]
Numbers = Mapping[str, float]


def _cast(graph: _Graph, x: str, arrays: Arrays, numbers: Numbers) -> str:
    graph.double = numbers["bits"] == 64
    return graph.to(x, int(numbers["bits"]))


def _compress(graph: _Graph, x: str, arrays: Arrays, numbers: Numbers) -> str:
    return _asinh(graph, graph("Div", x, graph.number(arrays["scale"])))


def _asinh(graph: _Graph, x: str) -> str:
    if not graph.double:
        return graph("Asinh", x)
    # ONNX Runtime has it for float32 only; features are not negative, so that nothing cancels
    root = graph("Sqrt", graph("Add", graph("Mul", x, x), graph.constant(1.0)))
    return graph("Log", graph("Add", x, root))


def _standardise(graph: _Graph, x: str, arrays: Arrays, numbers: Numbers) -> str:
    if arrays["mean"].ndim == 2:  # (batch, n) -> (batch, channels, n)
        x = graph("Unsqueeze", x, graph.whole(1))
    centred = graph("Sub", x, graph.number(arrays["mean"]))
    return graph("Div", centred, graph.number(arrays["std"]))


def _normalise(graph: _Graph, x: str, arrays: Arrays, numbers: Numbers) -> str:
    norm = graph("ReduceL2", x, graph.whole(1), keepdims=1)
    return graph("Div", x, graph.unless_zero(norm))


def _convolve(graph: _Graph, x: str, arrays: Arrays, numbers: Numbers) -> str:
    weight, bias = arrays["weight"], arrays["bias"]
    if weight.shape[1] == 1:  # the first: (batch, n) -> (batch, 1, n)
        x = graph("Unsqueeze", x, graph.whole(1))
    half = weight.shape[2] // 2
    inputs = (x, graph.number(weight), graph.number(bias))
    return graph("Conv", *inputs, pads=[half, half], strides=[int(numbers["stride"])])


def _relu(graph: _Graph, x: str, arrays: Arrays, numbers: Numbers) -> str:
    return graph("Relu", x)


def _dense(graph: _Graph, x: str, arrays: Arrays, numbers: Numbers) -> str:
    flat = graph("Flatten", x, axis=1)
    product = graph("MatMul", flat, graph.number(arrays["weight"].T))
    return graph("Add", product, graph.number(arrays["bias"]))


def _squared_distances(graph: _Graph, x: str, rows: np.ndarray) -> str:
    """Return |x - row|^2 (batch, rows)."""
    exact = rows.astype(np.float64)
    squares = graph.sum(graph("Mul", x, x), 1, keepdims=1)
    factor = graph.to(graph.constant(-2 * rows.T, rows.dtype), 64)  # stored as it is: half as long
    products = graph("MatMul", x, factor)
    total = graph("Add", graph("Add", squares, products), graph.number((exact * exact).sum(1)))
    return graph("Max", total, graph.number(0.0))


def _absolute_distances(graph: _Graph, x: str, rows: np.ndarray) -> str:
    """Return the sum of |x - row| (batch, rows)."""
    each = graph("Unsqueeze", x, graph.whole(1))  # (batch, 1, n)
    return graph.sum(graph("Abs", graph("Sub", each, graph.number(rows))), 2)


def _neighbours(graph: _Graph, x: str, arrays: Arrays, numbers: Numbers) -> str:
    far = _squared_distances if numbers["power"] == 2 else _absolute_distances
    distances = far(graph, x, arrays["row"])
    nearest = f"nearest_{len(graph.nodes)}"
    inputs = [distances, graph.whole(int(numbers["k"]))]
    outputs = [f"{nearest}_distance", nearest]
    graph.nodes.append(helper.make_node("TopK", inputs, outputs, axis=1, largest=0))
    values = graph("Gather", graph.number(arrays["value"]), nearest, axis=0)
    return graph("ReduceMean", values, graph.whole(1), keepdims=0)


def _kernel(graph: _Graph, x: str, arrays: Arrays, numbers: Numbers) -> str:
    distances = _squared_distances(graph, x, arrays["row"])
    return graph("Exp", graph("Mul", distances, graph.number(-numbers["gamma"])))


def _vote(graph: _Graph, x: str, arrays: Arrays, numbers: Numbers) -> str:
    wins = graph.to(graph("Greater", x, graph.number(0.0)), 64)
    loses = graph("Sub", graph.number(1.0), wins)
    first = graph("MatMul", wins, graph.number(arrays["first"]))
    return graph("Add", first, graph("MatMul", loses, graph.number(arrays["second"])))


def _trees(graph: _Graph, x: str, arrays: Arrays, numbers: Numbers) -> str:
    table = {
        name: graph.constant(arrays[name], arrays[name].dtype)
        for name in ("feature", "threshold", "left", "right", "value")
    }
    x = graph.to(x, 64)
    graph.double = True
    count = graph("Shape", x, start=0, end=1)
    shape = graph("Concat", count, graph.whole(len(arrays["root"])), axis=0)
    node = graph("Expand", graph.constant(arrays["root"], np.int64), shape)  # (batch, trees)
    for _ in range(int(numbers["depth"])):
        of = {name: graph("Gather", table[name], node, axis=0) for name in table if name != "value"}
        value = graph("GatherElements", x, of["feature"], axis=1)
        goes_left = graph("LessOrEqual", value, of["threshold"])
        node = graph("Where", goes_left, of["left"], of["right"])
    leaves = graph("Gather", table["value"], node, axis=0)  # (batch, trees, values)
    each = graph("Reshape", leaves, graph.whole(0, -1, int(numbers["outputs"])))
    return graph.sum(each, 1)


def _softmax(graph: _Graph, x: str, arrays: Arrays, numbers: Numbers) -> str:
    return graph("Softmax", x, axis=1)


def _turn(graph: _Graph, x: str, arrays: Arrays, numbers: Numbers) -> str:
    """Return the direction of (cosine, sine) in turns, from the arcus tangent of half of it.

    atan2(s, c) = 2 atan(s / (r + c)); where c < 0 that is pi - 2 atan(s / (r - c)), so that nothing
    cancels.
    """
    graph.double = True
    x = graph.to(x, 64)
    sine, cosine = (
        graph("Slice", x, graph.whole(n), graph.whole(n + 1), graph.whole(1)) for n in (0, 1)
    )
    radius = graph("Sqrt", graph.sum(graph("Mul", x, x), 1, keepdims=1))
    below = graph("Add", radius, graph("Abs", cosine))
    ratio = graph("Div", sine, graph.unless_zero(below))
    # ONNX Runtime has the arcus tangent for float32 only: 1e-7 turns
    angle = graph.to(graph("Atan", graph.to(ratio, 32)), 64)
    turns = graph("Mul", angle, graph.constant(1 / np.pi))
    mirrored = graph("Sub", graph.constant(0.5), turns)
    turns = graph("Where", graph("Less", cosine, graph.constant(0.0)), mirrored, turns)
    turns = graph("Sub", turns, graph("Floor", turns))
    return graph("Mul", turns, graph.constant(numbers["period"]))


_STEPS = {
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


def _answer(graph: _Graph, score: str, about: Mapping[str, Any]) -> list[tuple]:
    """Add what is said of the scores: class and probability, or number and interval."""
    calibration = about["calibration"]
    if not about["classes"]:
        value = graph("Squeeze", score, graph.whole(1))
        graph.to(value, 32, name="value")
        half = calibration["half_width"]
        side = graph.constant(np.inf if half is None else half)
        graph.to(graph("Sub", value, side), 32, name="low")
        graph.to(graph("Add", value, side), 32, name="high")
        return [(name, TensorProto.FLOAT, []) for name in ("value", "low", "high")]
    graph("ArgMax", score, axis=1, keepdims=0, name="class")
    said: list[tuple] = [("class", TensorProto.INT64, [])]
    if about["probabilities"]:
        logs = graph("Log", graph("Max", score, graph.constant(TINIEST)))
        scaled = graph("Div", logs, graph.constant(calibration["temperature"]))
        graph.to(graph("Softmax", scaled, axis=1), 32, name="probability")
        said.append(("probability", TensorProto.FLOAT, ["outputs"]))
    return said


def _guard(graph: _Graph, feature: str, exported: Exported) -> list[tuple]:
    """Add `novelty` (batch,), and `verdict`: 0 known, 1 nothing, 2 unknown, 3 not checked.

    Without a threshold there is no `novelty`.
    """
    guard, threshold = exported.guard, exported.about["calibration"]["novelty_threshold"]
    if guard is None:
        return []
    graph.double = True
    scale = graph.constant(guard["scale"])
    z = _asinh(graph, graph("Div", graph.to(feature, 64), scale))
    z = _standardise(graph, z, guard, {})
    near = graph(
        "ReduceMin", _squared_distances(graph, z, guard["grasps"]), graph.whole(1), keepdims=0
    )
    # Without a threshold no distance is too far, and every other verdict is 3.
    novelty = graph("Div", graph("Sqrt", near), graph.constant(threshold or np.inf))
    new = graph("Greater", novelty, graph.constant(1.0))
    near_code = graph.constant(0 if threshold else 3, np.int64)
    verdict = graph("Where", new, graph.constant(2, np.int64), near_code)
    if len(guard["references"]):
        empty = _squared_distances(graph, z, guard["references"])
        empty = graph("ReduceMin", empty, graph.whole(1), keepdims=0)
        nothing = graph("Less", empty, near)
        verdict = graph("Where", nothing, graph.constant(1, np.int64), verdict)
    graph("Identity", verdict, name="verdict")
    outputs: list[tuple] = [("verdict", TensorProto.INT64, [])]
    if threshold:
        graph.to(novelty, 32, name="novelty")
        outputs.insert(0, ("novelty", TensorProto.FLOAT, []))
    return outputs
