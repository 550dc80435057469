"""Excitation: the error of models against the length of what is played, for each kind of sound.

`measure` makes the tables; `shown` reads them back, draws and tells.
"""

from __future__ import annotations

import time
from typing import Annotated

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from ajgdata.evaluate.task_data import TaskData
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Outcome,
    Render,
    fold_scores,
    score_table,
)
from ajgdata.experiments.excitation.shown import (
    BAND_HZ,
    NAMES,
    REFERENCE,
    figures,
    highlights,
    tables,
)
from ajgdata.types import (
    ExcitationKind,
    ExcitationSpec,
    FeatureSettings,
    Kind,
    ModelName,
    NotPossibleError,
    Strict,
)
from ajgdata.types.table import table_of


class Settings(Strict):
    """Error against the length of the excitation, for each kind, at one peak level."""

    lengths_s: tuple[Annotated[float, Field(gt=0)], ...] = Field(
        (0.1, 0.25, 0.5, 1.0, 2.0), min_length=2, description="lengths of each kind"
    )
    kinds: tuple[ExcitationKind, ...] = Field(
        tuple(NAMES), min_length=1, description="kinds of excitation"
    )
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear_plain"), min_length=1, description="models that are evaluated with each"
    )
    slow: tuple[ModelName, ...] = Field(
        ("cnn",), description="models that meet kinds other than the paper's at `slow_lengths_s`"
    )
    slow_lengths_s: tuple[Annotated[float, Field(gt=0)], ...] = Field(
        (0.1, 0.25, 1.0), description="lengths of other kinds that slow models meet"
    )
    responses: int = Field(
        16, ge=1, description="recordings whose response is recovered and held beside the true one"
    )


def declared(settings: Settings) -> list[ExcitationSpec]:
    """Return what is played, the paper's sweep first: all at its peak level, else by default."""
    adapter: TypeAdapter[ExcitationSpec] = TypeAdapter(ExcitationSpec)
    level = {"amplitude": REFERENCE.amplitude}
    asked = [
        adapter.validate_python({"kind": kind, "length_s": length, **level})
        for kind in settings.kinds
        for length in sorted(settings.lengths_s)
    ]
    return [REFERENCE, *(one for one in asked if one != REFERENCE)]


def check(settings: Settings, _: Kind, features: FeatureSettings) -> None:
    """Raise ValueError for what cannot be played, and for features that not every sound has."""
    try:
        declared(settings)
    except ValidationError as error:
        message = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise ValueError(f"excitation: {message}") from None
    if features.kind == "sweep_tracking":
        raise ValueError("excitation: features.kind sweep_tracking is for sweeps alone")
    if features.align:
        raise ValueError("excitation: simulated recordings need no features.align")


def measure(inputs: Inputs, settings: Settings, _: str) -> Outcome:
    """Return errors of the models with each excitation, and of the responses recovered from it.

    The grasps, noise and folds are the same for all. Raises ValueError for a data set that is not
    simulated.
    """
    from threadpoolctl import threadpool_limits

    from ajgdata.acquire.excitation import crest_factor_db, excitation_samples
    from ajgdata.evaluate.crossval import cross_validate

    data, tried = inputs.data(), declared(settings)
    try:
        sounds = [excitation_samples(one, inputs.audio.sample_rate_hz) for one in tried]
    except ValueError as error:  # beyond half the rate of the recordings
        raise NotPossibleError(str(error)) from None
    scores, costs, points = [], [], []
    with threadpool_limits(limits=1):
        features = features_of(inputs, data, sounds)
        errors_db = recovered_db(inputs, data, settings.responses, sounds)
    for one, sound, (feature, seconds), error_db in zip(
        tried, sounds, features, errors_db, strict=True
    ):
        part = f"excitation:{one.kind} {one.length_s:g} s"
        costs.append(("", f"cost of {part}", "feature_s_per_recording", "measured", seconds))
        points.append(
            {"part": part, "kind": one.kind, "length_s": one.length_s, "level": one.level_dbfs}
            | {"crest_db": crest_factor_db(sound), "recovered_db": float(np.median(error_db))}
            | {"worst_db": float(np.max(error_db))}
        )
        for model in _meeting(settings, one):
            found = cross_validate(feature, data.value, data.group, model=model, **inputs.split)
            scores += list(fold_scores(model, part, found.scores))
            times = {"train_cpu_s": found.cost.train_cpu_s}
            times["inference_s_per_recording"] = found.cost.inference_s_per_recording
            costs += [(model, f"cost of {part}", name, "measured", s) for name, s in times.items()]
    columns = {"part": "Excitation", "kind": "Kind", "length_s": "Length, s"}
    columns |= {"level": "Peak, dBFS", "crest_db": "Crest factor, dB"}
    columns |= {"recovered_db": "Error of response, dB", "worst_db": "Largest, dB"}
    title = "Excitation"
    return Outcome(
        (score_table(scores, title), table_of("excitations", title, points, **columns)),
        (score_table(costs, title),),
    )


def _meeting(settings: Settings, one: ExcitationSpec) -> list[str]:
    """Return the models that are evaluated with an excitation."""
    few = one.kind == REFERENCE.kind or one.length_s in settings.slow_lengths_s
    return [model for model in settings.models if few or model not in settings.slow]


def features_of(
    inputs: Inputs, data: TaskData, sounds: list[np.ndarray]
) -> list[tuple[np.ndarray, float]]:
    """Return features (n, bins) of the recordings with each sound, and the median seconds of one.

    Settings of the feature are the data set's: a longer recording has more windows in the sum.
    """
    from ajgdata.features.maker import feature_maker

    rate = inputs.audio.sample_rate_hz
    makers = [feature_maker(inputs.features, rate, sound) for sound in sounds]
    features: list[list[np.ndarray]] = [[] for _ in sounds]
    seconds: list[list[float]] = [[] for _ in sounds]
    for recordings in _render(inputs)(data.name.tolist(), sounds):
        for n, (make, samples) in enumerate(zip(makers, recordings, strict=True)):
            begun = time.process_time()
            features[n].append(make(samples.astype(np.float32)))
            seconds[n].append(time.process_time() - begun)
    return [
        (np.array(made), float(np.median(times)))
        for made, times in zip(features, seconds, strict=True)
    ]


def recovered_db(
    inputs: Inputs, data: TaskData, count: int, sounds: list[np.ndarray]
) -> list[np.ndarray]:
    """Return for each sound the errors in dB, (responses,), of transfer functions recovered from
    recordings: |Ĥ - H| over |H|, each summed over BAND_HZ.

    H is what a click gives without noise; 24 bits leave it some 100 dB above its rounding.
    """
    from ajgdata.features.transfer_function import Deconvolution

    render, window = _render(inputs), inputs.features.window
    names = data.name[np.unique(np.linspace(0, len(data.name) - 1, count).round().astype(int))]
    frequency = np.fft.rfftfreq(window, 1 / inputs.audio.sample_rate_hz)
    inside = (frequency >= BAND_HZ[0]) & (frequency <= BAND_HZ[1])
    click = np.zeros(window)
    click[0] = REFERENCE.amplitude
    heard = render(names.tolist(), [click], quiet=True)
    true = np.array([np.fft.rfft(one / REFERENCE.amplitude)[inside] for (one,) in heard])
    errors = []
    for sound in sounds:  # one after another: a solver holds 32 MB
        solver = Deconvolution(sound, window)
        recordings = (one for (one,) in render(names.tolist(), [sound]))
        found = np.array([solver.transfer_function(one)[inside] for one in recordings])
        share = np.linalg.norm(found - true, axis=1) / np.linalg.norm(true, axis=1)
        errors.append(20 * np.log10(share))
    return errors


def _render(inputs: Inputs) -> Render:
    if inputs.render is None:
        raise NotPossibleError("it needs a virtual data set: other sounds are played in its scenes")
    return inputs.render


EXPERIMENT = Experiment(
    name="excitation",
    order=72,
    title="Excitation",
    settings=Settings,
    measure=measure,
    figures=figures,
    tables=tables,
    highlights=highlights,
    check=check,
    renders=True,
)
