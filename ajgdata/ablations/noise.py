"""Noise from outside: what the microphone hears is lost in it, or the model never met it."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ajgdata.ablations.base import Ablation, Hypothesis, Trial, folds_of, trial_table
from ajgdata.ablations.data import QUIET, AblationData
from ajgdata.evaluate.task_data import TaskData
from ajgdata.gripper import SAMPLE_RATE_HZ
from ajgdata.models import model_label
from ajgdata.report.blocks import TableFigure
from ajgdata.report.format import number
from ajgdata.types import FeatureSettings
from ajgdata.types.table import Column, Table, Value, table_of

if TYPE_CHECKING:
    from ajgdata.evaluate.crossval import CrossValidation
    from ajgdata.report.marks import Picture

QUIET_DBA = 45
LOUD_DBA = (60, 70, 80, 90)
#: The paper's loudest.
TOLD_DBA = 80
#: Edges in Hz; the last but one band is the one that a model is confined to.
EDGES_HZ = (20, 300, 1_000, 3_000, 8_000, 20_000)
BAND_HZ = (3_000, 8_000)
#: Errors (mm) that are ticks.
TICKS_MM = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)
#: Data sets by level.
DATASETS = {QUIET_DBA: "size", **{level: f"size_{level}dba" for level in LOUD_DBA}}
#: The CNN with one scale for all bins. The experiment `repeated_fits` compares it with the CNN: the
#: folds of one fit differ too much for a test.
ONE_SCALE = "cnn_one_scale"
ABSOLUTE = FeatureSettings(quantity="power", normalisation="none")

UNHEARD = Hypothesis(
    ("noise",), "a model that never heard noise mistakes it", "trained at all five levels"
)
SWAMPED = Hypothesis(
    ("noise",),
    "noise swamps one part of the band and leaves another clear",
    f"only {BAND_HZ[0] / 1000:g}–{BAND_HZ[1] / 1000:g} kHz, trained at {QUIET_DBA} dB(A)",
)
LOST = Hypothesis(
    (),
    f"what tells sizes apart is lost at {TOLD_DBA} dB(A), for a model that knows the noise, too",
    f"from {TOLD_DBA} to {QUIET_DBA} dB(A), trained at all five levels",
)


def measure(data: AblationData) -> list[Table]:
    """Return trials, errors at all levels, and where in the band the noise is."""
    levels = {level: data.known("size", "size", name) for level, name in DATASETS.items()}
    together = TaskData(
        *(np.concatenate(columns) for columns in zip(*levels.values(), strict=True))
    )
    band = {level: _confined(rows) for level, rows in levels.items()}
    trials, rows = [], []
    for model in data.models:
        found = {
            f"at {QUIET_DBA} dB(A)": _tested(data, model, levels[QUIET_DBA], levels),
            "at all levels": _tested(data, model, together, levels),
            f"at {QUIET_DBA} dB(A), {BAND_HZ[0]}–{BAND_HZ[1]} Hz only": _tested(
                data, model, band[QUIET_DBA], band
            ),
        }
        plain, heard, confined = found.values()
        told, quiet = str(TOLD_DBA), str(QUIET_DBA)
        for hypothesis, first, second in (
            (UNHEARD, folds_of(plain, "rmse", told), folds_of(heard, "rmse", told)),
            (SWAMPED, folds_of(plain, "rmse", told), folds_of(confined, "rmse", told)),
            (LOST, folds_of(heard, "rmse", told), folds_of(heard, "rmse", quiet)),
        ):
            trials.append(Trial(hypothesis, model, "rmse", "mm", first, second))
        if model == "cnn":
            one_scale = _tested(data, ONE_SCALE, levels[QUIET_DBA], levels)
            rows.append(_row(ONE_SCALE, f"at {QUIET_DBA} dB(A)", one_scale))
        rows += [_row(model, name, one) for name, one in found.items()]
    note = f"Edge length of cubes, tested at {TOLD_DBA} dB(A) of white noise outside."
    return [
        trial_table("noise", "Noise: lost, or never met", note, trials),
        _level_table(rows),
        _band_table(data),
    ]


def _tested(
    data: AblationData, model: str, rows: TaskData, levels: dict[int, TaskData]
) -> CrossValidation:
    """Return a validation of training on `rows`, tested on grasps held out at each level."""
    extra_tests = {str(level): tested for level, tested in levels.items()}
    return data.validated(rows, "regression", model, extra_tests=extra_tests)


def _confined(rows: TaskData) -> TaskData:
    """Return the same recordings within BAND_HZ, normalised again."""
    from ajgdata.features.bands import within
    from ajgdata.features.spectrum import frequencies_hz

    settings = FeatureSettings()
    frequency = frequencies_hz(SAMPLE_RATE_HZ, settings)
    return rows._replace(
        feature=within(rows.feature, frequency, BAND_HZ, settings.normalisation)[0]
    )


def _row(model: str, trained: str, found: CrossValidation) -> dict[str, Value]:
    errors = {
        f"rmse_{level}": float(np.mean(folds_of(found, "rmse", level).values))
        for level in found.extra_tests
    }
    name = model_label(model, "regression")
    return {"model": name, "trained": trained, **errors, "seconds": found.cost.train_cpu_s}


def _level_table(rows: list[dict[str, Value]]) -> Table:
    levels = [
        Column(f"rmse_{level}", f"RMSE at {level} dB(A)", "mm") for level in (QUIET_DBA, *LOUD_DBA)
    ]
    return Table(
        "noise_levels",
        "Noise: what a model has met",
        "Error of the edge length on grasps held out, mean over folds, by the level of white noise"
        " outside and by what the model was trained on.",
        (
            Column("model", "Model"),
            Column("trained", "Trained"),
            *levels,
            Column("seconds", "Training", "s"),
        ),
        tuple(rows),
    )


def _band_table(data: AblationData) -> Table:
    """Return the sweep's sound and the noise's by band, each recorded without the other."""
    from ajgdata.features.spectrum import frequencies_hz, spectrum
    from ajgdata.gripper import excitation_sweep, record
    from ajgdata.gripper.external_noise import transmission

    setup = data.grasps("size")[0].setup
    response, sweep = data.response(setup), excitation_sweep()
    frequency = frequencies_hz(SAMPLE_RATE_HZ, ABSOLUTE)
    outside = QUIET.model_copy(update={"external_noise_dba": float(TOLD_DBA)})
    signal, noise = (
        spectrum(record(response, played, chain).samples, SAMPLE_RATE_HZ, ABSOLUTE)
        for played, chain in ((sweep, QUIET), (np.zeros_like(sweep), outside))
    )
    assert response.outside is not None, "simulated just now"
    known = np.linspace(0, SAMPLE_RATE_HZ / 2, len(response.outside))
    share = np.interp(frequency, known, response.outside**2)
    limp = transmission(frequency, response.membrane_kg_m2)
    rows: list[dict[str, Value]] = []
    for low, high in pairwise(EDGES_HZ):
        inside = (frequency >= low) & (frequency < high)
        rows.append(
            {
                "band": f"{low}–{high}",
                "held_back": float(-10 * np.log10(share[inside].mean())),
                "mass_law": float(-10 * np.log10(limp[inside].mean())),
                "ratio": float(10 * np.log10(signal[inside].sum() / noise[inside].sum())),
            }
        )
    return Table(
        "noise_bands",
        "Noise: where in the band it is",
        f"The smallest cube, {TOLD_DBA} dB(A) of white noise outside. What membrane and cavity hold"
        " back of it, and what a limp wall of the membrane's mass would (negative: it is louder at"
        " the microphone than in the room); what is left is set against the sweep's own sound"
        " (power over the whole recording, neither with the other).",
        (
            Column("band", "Band", "Hz"),
            Column("held_back", "Held back", "dB"),
            Column("mass_law", "By the mass law", "dB"),
            Column("ratio", "Sweep over noise", "dB"),
        ),
        tuple(rows),
    )


def finding(table: Table) -> str:
    """Return the best and the worst that a model trained on does at the loudest level."""
    key = _levels(table)[-1]
    errors = table.numbers(key)
    best, worst = (table.rows[int(f(errors))] for f in (np.argmin, np.argmax))
    told = [
        f"{row['model']} trained {row['trained']} errs by {number(float(row[key] or 0), 2)} mm"
        for row in (best, worst)
    ]
    return f"At {key.removeprefix('rmse_')} dB(A) {', '.join(told)}"


def _levels(table: Table) -> list[str]:
    return [column.key for column in table.columns if column.key.startswith("rmse_")]


def levels(table: Table) -> Picture:
    """Return the error against the level of noise, by model and training data."""
    from ajgdata.report.study_figures import picture_of, points_of

    rows = [
        {"series": f"{row['model']}, {row['trained']}", "value": row[key],
         "level": float(key.removeprefix("rmse_"))}
        for row in table.rows
        for key in _levels(table)
    ]  # fmt: skip
    points = points_of(
        table_of("", "", rows, **dict.fromkeys(rows[0], "")), "value", "series", "level"
    )
    about = "edge length on grasps held out, by what a model was trained on"
    axis, place = ("RMSE", "mm"), ("white noise outside", "dB(A)")
    return picture_of(finding(table), about, points, axis, place)


ABLATION = Ablation(
    "noise",
    datasets=tuple(DATASETS.values()),
    measure=measure,
    figures=(
        TableFigure(
            "noise_levels",
            "levels",
            "lines",
            levels,
            "Error of the edge length against the level of noise outside.",
        ),
    ),
)
