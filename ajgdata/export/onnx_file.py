"""A trained model as one ONNX graph (waveform in, calibrated answer out), and how to run it.

The transform is in float64: in float32, ONNX Runtime has errors of 3e-5 where the window is not a
power of two.
"""

from __future__ import annotations

import json
import logging
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from ajgdata.evaluate.calibration import TINIEST
from ajgdata.evaluate.novelty import Guard
from ajgdata.export.torch_model import Compress, Standardise, squared_distances, torch_model
from ajgdata.features.checks import TOO_QUIET
from ajgdata.features.spectrum import periodic_window
from ajgdata.live.predictor import Predictor
from ajgdata.types import DataError, FeatureSettings

METADATA = "ajgdata"  #: key of the metadata that hold the description of the model, as JSON
VERDICTS = ("known", "nothing", "unknown", "not checked")
OPSET = 20


class Feature(nn.Module):
    """Waveforms to what `features.spectrum.spectrum` computes of them, and whether to use them."""

    window: Tensor

    def __init__(self, settings: FeatureSettings, first: int, bins: int) -> None:
        super().__init__()
        self.settings, self.band = settings, slice(first, first + bins)
        window = periodic_window(settings.window_shape, settings.window).astype(np.float32)
        self.register_buffer("window", torch.from_numpy(window).double())

    def forward(self, waveform: Tensor) -> tuple[Tensor, Tensor]:
        """Return usable (n,) and features (n, bins), float32, of waveforms (n, samples)."""
        peak = waveform.abs().amax(1, keepdim=True).double()
        moves = waveform.amax(1) > waveform.amin(1)
        usable = (peak[:, 0] >= TOO_QUIET) & torch.isfinite(waveform.sum(1)) & moves
        samples = waveform.double() / torch.where(peak > 0, peak, 1.0)
        window, hop = self.settings.window, self.settings.hop
        parts = torch.stft(
            samples, window, hop, window=self.window, center=False, return_complex=True
        )  # -> (n, window/2 + 1, frames)
        power = torch.view_as_real(parts).square().sum(-1)
        quantity = self.settings.quantity
        total = (power.sqrt() if quantity == "magnitude" else power).sum(2)
        total = (total.sqrt() if quantity == "root_power" else total)[:, self.band]
        return usable, self._normalised(total, peak).float()

    def _normalised(self, total: Tensor, peak: Tensor) -> Tensor:
        normalisation = self.settings.normalisation
        if normalisation == "none":  # back to the amplitude of the recording
            return total * (peak * peak if self.settings.quantity == "power" else peak)
        if normalisation == "l1":
            norm = total.sum(1, keepdim=True)
        elif normalisation == "l2":
            norm = total.square().sum(1, keepdim=True).sqrt()
        else:
            norm = total.amax(1, keepdim=True)
        return total / torch.where(norm > 0, norm, 1.0)


class Novelty(nn.Module):
    """Distance to the nearest grasp, and the verdict, as `evaluate.novelty.Guard` has them."""

    grasps: Tensor
    references: Tensor

    def __init__(self, guard: Guard) -> None:
        super().__init__()
        self.points = nn.Sequential(
            Compress(float(guard.scale)), Standardise(guard.mean, guard.std)
        )
        self.threshold = guard.threshold
        self.has_references = len(guard.references) > 0
        self.register_buffer("grasps", torch.tensor(guard.grasps))
        self.register_buffer("references", torch.tensor(guard.references))

    def forward(self, feature: Tensor) -> dict[str, Tensor]:
        """Return novelty (n,), if there is a threshold, and the number of the verdict (n,)."""
        z = self.points(feature.double())
        near = squared_distances(z, self.grasps).amin(1)
        outputs = {}
        verdict = torch.full_like(near, 3, dtype=torch.int64)
        if self.threshold:
            novelty = near.sqrt() / self.threshold
            outputs["novelty"] = novelty.float()
            verdict = torch.where(novelty > 1, 2, 0)
        if self.has_references:
            nothing = squared_distances(z, self.references).amin(1) < near
            verdict = torch.where(nothing, 1, verdict)
        return outputs | {"verdict": verdict}


class Deployed(nn.Module):
    """All steps from waveforms to what `Predictor.predict` returns, as named tensors."""

    def __init__(self, predictor: Predictor) -> None:
        super().__init__()
        rate, settings = predictor.sample_rate_hz, predictor.features
        frequency = predictor.frequency_hz
        first = round(frequency[0] * settings.window / rate)
        self.feature = Feature(settings, first, len(frequency))
        self.model = torch_model(predictor.estimator)
        self.novelty = Novelty(predictor.guard) if len(predictor.guard.grasps) else None
        self.is_number = predictor.kind == "regression"
        self.temperature = predictor.temperature
        self.half_width = predictor.calibration.half_width

    def forward(self, waveform: Tensor) -> dict[str, Tensor]:
        """Return the outputs of the file by name, see docs/export.md."""
        usable, feature = self.feature(waveform)
        outputs = {"usable": usable, "feature": feature}
        score = self.model(feature)
        if self.is_number:
            value, half = score[:, 0], np.inf if self.half_width is None else self.half_width
            outputs |= {"value": value.float()}
            outputs |= {"low": (value - half).float(), "high": (value + half).float()}
        else:
            outputs["class"] = score.argmax(1)
        if self.temperature is not None:
            scaled = torch.log(score.clamp(min=TINIEST)) / self.temperature
            outputs["probability"] = scaled.softmax(1).float()
        return outputs | (self.novelty(feature) if self.novelty else {})


def onnx_bytes(predictor: Predictor, about: Mapping[str, Any]) -> bytes:
    """Return the ONNX file of a model; `about` is stored in its metadata.

    Raises NotPossibleError for models without a torch module.
    """
    from onnx.helper import set_model_props

    deployed = Deployed(predictor).eval()
    example = torch.zeros(2, 2 * predictor.samples)
    sizes = {0: torch.export.Dim("batch"), 1: torch.export.Dim("samples", min=predictor.samples)}
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)  # torchvision is not installed
    with warnings.catch_warnings(), torch.no_grad():
        warnings.simplefilter("ignore")  # torch's own, of its next versions
        program = torch.onnx.export(
            deployed,
            (example,),
            input_names=["waveform"],
            output_names=list(deployed(example)),
            dynamic_shapes=(sizes,),
            opset_version=OPSET,
            dynamo=True,
            verbose=False,
        )
    assert program is not None
    model = program.model_proto
    graph = model.graph
    for part in (graph, *graph.node, *graph.input, *graph.output, *graph.value_info):
        part.ClearField("metadata_props")  # paths of source files
    set_model_props(model, {METADATA: json.dumps(about, sort_keys=True, allow_nan=False)})
    return model.SerializeToString(deterministic=True)


class OnnxModel:
    """An exported file in ONNX Runtime. `about` describes the model."""

    def __init__(self, path: Path) -> None:
        """Raise DataError for a file that is missing, damaged, or not written by `onnx_bytes`."""
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        options.log_severity_level = 4  # errors are raised as well
        if not path.is_file():
            raise DataError(path, "there is no such file", "correct the name")
        try:
            self._session = onnxruntime.InferenceSession(
                path, options, providers=["CPUExecutionProvider"]
            )
        except Exception as error:  # the exceptions of the runtime have no common type
            problem = f"not a readable ONNX file ({' '.join(str(error).split())})"
            raise DataError(path, problem, "export it again") from None
        text = self._session.get_modelmeta().custom_metadata_map.get(METADATA)
        if text is None:
            raise DataError(path, "was not made by `ajgdata export`", "export it again")
        self.about = json.loads(text)

    def __call__(self, samples: np.ndarray) -> dict[str, Any]:
        """Return the outputs of the file for samples (n,), by name."""
        waveform = np.asarray(samples, np.float32)[np.newaxis]
        names = [output.name for output in self._session.get_outputs()]
        values = self._session.run(None, {"waveform": waveform})
        return {name: value[0] for name, value in zip(names, values, strict=True)}
