"""Export a trained network, with feature and calibration, as one ONNX graph for other computers.

The input of the graph is a waveform, and its outputs are those of `Predictor.predict`. The feature
is computed in float64, because ONNX Runtime has errors of 3e-5 in float32 if the window is not a
power of two. The network computes in float32.
"""

from __future__ import annotations

import json
import logging
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from ajgdata.evaluate.calibration import TINIEST
from ajgdata.evaluate.novelty import EQUAL, NoveltyGuard
from ajgdata.features.checks import TOO_QUIET
from ajgdata.features.spectrum import periodic_window
from ajgdata.live.predictor import Predictor
from ajgdata.models.inputs import WithDimensions
from ajgdata.types import FeatureSettings, NotPossibleError

#: Key of the file's metadata that contains the description of the model, as JSON.
METADATA = "ajgdata"
#: The output `verdict` is the position in this tuple.
NOVELTY_VERDICTS = ("known", "nothing", "unknown", "not checked", "no sign")
#: Version of the ONNX operators in the file.
OPSET = 20


class Feature(nn.Module):
    """The feature of `features.spectrum.spectrum`, and the checks of a waveform, in torch.

    The feature has `bins` bins of the spectrum, from bin number `first`.
    """

    window: Tensor

    def __init__(self, settings: FeatureSettings, first: int, bins: int) -> None:
        super().__init__()
        self.settings = settings
        self.band = slice(first, first + bins)
        window = periodic_window(settings.window_shape, settings.window).astype(np.float32)
        self.register_buffer("window", torch.from_numpy(window).double())

    def forward(self, waveform: Tensor) -> tuple[Tensor, Tensor]:
        """Return usable (n,), bool, and features (n, bins), float32, of waveforms (n, samples)."""
        peak = waveform.abs().amax(1, keepdim=True).double()  # -> (n, 1)
        is_loud = peak[:, 0] >= TOO_QUIET
        is_finite = torch.isfinite(waveform.sum(1))
        varies = waveform.amax(1) > waveform.amin(1)
        usable = is_loud & is_finite & varies
        samples = waveform.double() / torch.where(peak > 0, peak, 1.0)
        stft = torch.stft(
            samples,
            self.settings.window,
            self.settings.hop,
            window=self.window,
            center=False,
            return_complex=True,
        )  # -> (n, window/2 + 1, frames)
        power = torch.view_as_real(stft).square().sum(-1)
        if self.settings.quantity == "magnitude":
            total = power.sqrt().sum(2)
        elif self.settings.quantity == "root_power":
            total = power.sum(2).sqrt()
        else:
            total = power.sum(2)
        return usable, self._normalised(total[:, self.band], peak).float()

    def _normalised(self, total: Tensor, peak: Tensor) -> Tensor:
        """Return normalised sums over time (n, bins), for samples that were divided by `peak`."""
        normalisation = self.settings.normalisation
        if normalisation == "none":  # the amplitude of the recording
            return total * (peak * peak if self.settings.quantity == "power" else peak)
        if normalisation == "l1":
            norm = total.sum(1, keepdim=True)
        elif normalisation == "l2":
            norm = total.square().sum(1, keepdim=True).sqrt()
        else:
            norm = total.amax(1, keepdim=True)
        return total / torch.where(norm > 0, norm, 1.0)


class Novelty(nn.Module):
    """Both distances of `evaluate.novelty.NoveltyGuard`, and the verdict of `live.predictor`.

    `clear` is the verdict on a recording that the guard does not flag. The tensors are those of the
    guard.
    """

    grasps: Tensor
    references: Tensor
    mean: Tensor
    std: Tensor
    centre: Tensor
    components: Tensor
    within: Tensor
    total: Tensor
    objects: Tensor

    def __init__(self, guard: NoveltyGuard, clear: str) -> None:
        super().__init__()
        self.scale = float(guard.scale)
        self.clear = NOVELTY_VERDICTS.index(clear)
        self.threshold = guard.threshold
        self.relative_threshold = guard.relative_threshold
        self.has_references = len(guard.references) > 0
        for name in self.__annotations__:
            self.register_buffer(name, torch.tensor(getattr(guard, name), dtype=torch.float64))

    def forward(self, feature: Tensor) -> dict[str, Tensor]:
        """Return `novelty` (n,), if there is a threshold, and `verdict` (n,) of features (n, f)."""
        x = feature.double() / self.scale
        # This is asinh(x), which ONNX Runtime has only for float32.
        z = (torch.log(x + torch.sqrt(x * x + 1)) - self.mean) / self.std
        nearest = _squared_distances(z, self.grasps).amin(1)
        outputs = {}
        not_checked = NOVELTY_VERDICTS.index("not checked")
        verdict = torch.full_like(nearest, not_checked, dtype=torch.int64)
        if self.threshold:
            novelty = nearest.sqrt() / self.threshold
            if self.relative_threshold is not None:
                novelty = torch.maximum(novelty, self._relative(z) / self.relative_threshold)
            outputs["novelty"] = novelty.float()
            verdict = torch.where(novelty > 1, NOVELTY_VERDICTS.index("unknown"), self.clear)
        if self.has_references:
            is_empty = _squared_distances(z, self.references).amin(1) < nearest
            verdict = torch.where(is_empty, NOVELTY_VERDICTS.index("nothing"), verdict)
        outputs["verdict"] = verdict
        return outputs

    def _relative(self, z: Tensor) -> Tensor:
        """Return the relative distances (n,) of points (n, f), see `NoveltyGuard`."""
        coordinates = (z - self.centre) @ self.components.T
        to_object = _squared_distances(coordinates @ self.within, self.objects).amin(1).sqrt()
        to_centre = (coordinates / self.total).square().sum(1).sqrt()
        return to_object / to_centre.clamp(min=EQUAL)


def _squared_distances(x: Tensor, rows: Tensor) -> Tensor:
    """Return squared Euclidean distances (n, rows) between x (n, f) and rows (rows, f), float64."""
    squares = x.square().sum(1, keepdim=True) + rows.square().sum(1)
    return (squares - 2 * x @ rows.T).clamp(min=0)


class Deployed(nn.Module):
    """All steps of `Predictor.predict`, from waveforms to named tensors.

    Raises NotPossibleError for a model that is not a network.
    """

    def __init__(self, predictor: Predictor) -> None:
        super().__init__()
        settings = predictor.features
        if not isinstance(settings, FeatureSettings):
            raise NotPossibleError(
                f"a model of the feature {settings.kind} cannot be exported, only one of spectra"
            )
        if isinstance(predictor.audio.microphone, tuple):
            raise NotPossibleError("a model of several microphones cannot be exported")
        if predictor.covariates:
            raise NotPossibleError("a model with covariates cannot be exported")
        if isinstance(predictor.estimator, WithDimensions):
            raise NotPossibleError("a model that takes dimensions cannot be exported")
        frequency = predictor.frequency_hz
        first = round(frequency[0] * settings.window / predictor.sample_rate_hz)
        self.feature = Feature(settings, first, len(frequency))
        self.period: Any = getattr(predictor.estimator, "period", None)
        network: Any = getattr(predictor.estimator, "estimator_", predictor.estimator)
        if not hasattr(network, "module_"):
            raise NotPossibleError(f"{type(network).__name__} cannot be exported, only the CNN can")
        self.network = network.module_
        clear = "known" if predictor.calibration.detects_novel_objects else "no sign"
        self.novelty = Novelty(predictor.guard, clear) if len(predictor.guard.grasps) else None
        self.is_number = predictor.kind == "regression"
        self.temperature = predictor.calibration.temperature
        self.half_width = predictor.calibration.half_width

    def forward(self, waveform: Tensor) -> dict[str, Tensor]:
        """Return the outputs by name for waveforms (n, samples), see docs/export.md."""
        usable, feature = self.feature(waveform)
        outputs = {"usable": usable, "feature": feature}
        score = self.network(feature).double()
        if self.is_number:
            value = score[:, 0] if self.period is None else self._target(score)
            half_width = np.inf if self.half_width is None else self.half_width
            outputs["value"] = value.float()
            outputs["low"] = (value - half_width).float()
            outputs["high"] = (value + half_width).float()
        else:
            outputs["class"] = score.argmax(1)
        if self.temperature is not None:
            scaled = torch.log(score.softmax(1).clamp(min=TINIEST)) / self.temperature
            outputs["probability"] = scaled.softmax(1).float()
        if self.novelty is not None:
            outputs.update(self.novelty(feature))
        return outputs

    def _target(self, point: Tensor) -> Tensor:
        """Return targets (n,) in [0, period) for points (n, 2), see `models.scaling.Circular`."""
        # ONNX Runtime has the arc tangent only for float32.
        turns = torch.atan2(point[:, 0].float(), point[:, 1].float()).double() / (2 * np.pi)
        return (turns - torch.floor(turns)) * self.period


def onnx_bytes(predictor: Predictor, about: Mapping[str, Any]) -> bytes:
    """Return the content of the ONNX file of a network; its metadata contain `about`.

    Raises NotPossibleError for a model that is not a network.
    """
    from onnx.helper import set_model_props  # an optional dependency

    deployed = Deployed(predictor).eval()
    window = predictor.features.least_samples(predictor.sample_rate_hz)
    example = torch.zeros(2, 2 * window)
    samples = torch.export.Dim("samples", min=window)
    sizes = {0: torch.export.Dim("batch"), 1: samples}
    # torch would report that torchvision, which no exported network needs, is missing.
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    with warnings.catch_warnings(), torch.no_grad():
        warnings.simplefilter("ignore")  # torch warns about changes in its next versions
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
    # torch stores the paths of its source files, which differ between computers.
    for part in (graph, *graph.node, *graph.input, *graph.output, *graph.value_info):
        part.ClearField("metadata_props")
    set_model_props(model, {METADATA: json.dumps(about, sort_keys=True, allow_nan=False)})
    return model.SerializeToString(deterministic=True)
