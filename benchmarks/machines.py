"""Measure how results differ between computers: published comparisons with other CPU kernels.

    python benchmarks/machines.py [--project DIR]

Measures ROWS from the feature files of a project, in one process per variant. A variant sets
environment variables: kernels of torch, oneDNN, OpenBLAS, numpy and numba as on CPUs with SSE, AVX2
or AVX-512, or numbers of threads. Variants with AVX-512 are measured only on CPUs with AVX-512.

All variants are measured on the rows PROBE. A variant is also measured on the other rows if it
changes a byte of these results, of a simulated recording or of a feature. Two unchanged runs must
give the same bytes. Writes `reports/machine_spread.yaml`, which the verdicts use, and prints the
table of docs/reproducibility.md. About 30 CPU minutes.

The spread of a row is the largest of three differences: the range over variants; the difference
that was measured on another computer (`other_machines`, which a person writes); and for a trained
network that is tested on classes, one test recording. Another computer acts like another order of
additions or another random state, so a range of 0 over some variants does not mean a spread of 0.
"""

import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer

from ajgdata.evaluate.parts import PLACEBO_VALUES, SESSION_SPLIT, TRAINING_VALUES
from ajgdata.experiments.requests import requested_experiments
from ajgdata.features.spectrum import spectrum
from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, excitation_sweep, record, simulate
from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import run_experiment
from ajgdata.store.audio import pcm24_bytes
from ajgdata.store.files import read_yaml, write_bytes, yaml_bytes
from ajgdata.store.provenance import software
from ajgdata.store.report_files import MACHINE_SPREAD_FILE
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import read_measurements
from ajgdata.types import CROSS_VALIDATION, FeatureSettings

HERE = Path(__file__).resolve().parents[1]
OLD_CPU = (
    "ATEN_CPU_CAPABILITY=default ONEDNN_MAX_CPU_ISA=SSE41 OPENBLAS_CORETYPE=Prescott "
    "NPY_DISABLE_CPU_FEATURES=X86_V3,X86_V4,AVX512_ICL,AVX512_SPR NUMBA_CPU_NAME=generic"
)
AVX2 = (
    "ATEN_CPU_CAPABILITY=avx2 ONEDNN_MAX_CPU_ISA=AVX2 OPENBLAS_CORETYPE=Haswell "
    "NPY_DISABLE_CPU_FEATURES=X86_V4,AVX512_ICL,AVX512_SPR NUMBA_CPU_NAME=haswell"
)
AVX512 = (
    "ATEN_CPU_CAPABILITY=avx512 ONEDNN_MAX_CPU_ISA=AVX512_CORE OPENBLAS_CORETYPE=SkylakeX "
    "NUMBA_CPU_NAME=skylake-avx512"
)
CPUINFO = Path("/proc/cpuinfo")
HAS_AVX512 = "avx512f" in CPUINFO.read_text(encoding="utf-8").split()
HERE_RUN = "unchanged"
AGAIN = "unchanged again"
FEW = ("OPENBLAS_CORETYPE=Haswell", "OMP_NUM_THREADS=1", "OMP_NUM_THREADS=4")
WIDE = (AVX2, AVX512) if HAS_AVX512 else (AVX2,)
VARIANTS = (HERE_RUN, AGAIN, *OLD_CPU.split(), *FEW, OLD_CPU, *WIDE)
LONG = (HERE_RUN, OLD_CPU, AVX2, AVX512)  #: variants that also have the ten repeated fits
#: Published values that all variants are measured for.
PROBE = ("materials-sphere80", "baselines")
#: Models whose results depend on the order of additions.
NETWORKS = ("cnn",)
REPEATED_FITS = "repeated_fits"


class MeasurementId(NamedTuple):
    """The result of an experiment with one model."""

    dataset: str
    task: str
    experiment: str
    model: str


class MeasuredRow(NamedTuple):
    """A row of the table: a published value, and the result that is compared with it."""

    figure: str  #: name of the published value
    dataset: str
    task: str
    score: str  #: test recordings (see `_part`) and statistic of the score
    model: str = "cnn"
    experiment: str = CROSS_VALIDATION

    @property
    def measurement(self) -> MeasurementId:
        """The result that contains the score."""
        return MeasurementId(self.dataset, self.task, self.experiment, self.model)


ROWS = (
    MeasuredRow("size", "size", "size", "all mean"),
    MeasuredRow("size-known", "size", "size", "grouped mean"),
    MeasuredRow("size-known", "size", "size", "random mean"),
    MeasuredRow("size-unknown", "size", "size", "withheld mean"),
    MeasuredRow("noise", "size", "noise", "on size_80dba median", experiment=REPEATED_FITS),
    MeasuredRow("orientation", "orientation", "angle", "withheld mean"),
    MeasuredRow("orientation-known", "orientation", "angle", "grouped mean"),
    MeasuredRow("orientation-known", "orientation", "angle", "random mean"),
    MeasuredRow("materials-sphere80", "sphere80", "material", "grouped mean"),
    MeasuredRow("materials-plate", "plate", "material", "grouped mean"),
    MeasuredRow("materials-sphere30", "sphere30", "material", "grouped mean"),
    MeasuredRow("ycb", "ycb", "object", "grouped mean"),
    MeasuredRow("baselines", "ycb", "baselines", "grouped mean", model="knn_plain"),
)
SIMULATED = (("size", 8), ("plate", 0))  #: data set, and number of the object in its recipe


def steps(paths: Paths) -> dict[str, str]:
    """Return digests of simulated recordings, and of the feature of a fixed random signal."""
    content = {}
    for name, number in SIMULATED:
        recipe = read_dataset(paths, name).recipe
        scene = Scene.model_validate({**recipe.scene, "object": recipe.objects[number].shape})
        samples = record(simulate(scene), excitation_sweep(), seed=1).samples
        content[f"simulated recording of `{name}`"] = pcm24_bytes(samples, SAMPLE_RATE_HZ)
    fixed = np.random.default_rng(0).integers(-(2**22), 2**22, SAMPLE_RATE_HZ) / 2**23
    content["feature"] = spectrum(fixed, SAMPLE_RATE_HZ, FeatureSettings()).tobytes()
    return {step: hashlib.sha256(part).hexdigest() for step, part in content.items()}


def measured(paths: Paths, measurement: MeasurementId, *, random: bool) -> dict[str, Any]:
    """Return the digest of the result of an experiment, and its values by part and statistic.

    `random` is whether a random split is also evaluated.
    """
    dataset, task, experiment, model = measurement
    spec = read_dataset(paths, dataset)
    task_settings = spec.task_settings(task)
    requests = requested_experiments(spec, task)
    (request,) = (item for item in requests if item.experiment.name == experiment)
    request = request.only([model])
    settings = request.job_settings()
    if experiment == CROSS_VALIDATION:
        # Only the published splits have a spread; the controls would double the time.
        settings |= {"compare_random": random, "compare_sessions": False, "placebo": None}
    with tempfile.TemporaryDirectory() as folder:
        tables = Path(folder, "tables.json")
        run_experiment(
            paths.features(dataset),
            dataset=dataset,
            task=task,
            experiment=experiment,
            parts=request.part_names,
            settings=settings,
            task_settings=task_settings,
            other_sets=request.other_sets,
            audio=spec.audio,
            features=spec.features,
            paths=paths,
            seed=0,
            tables=tables,
            cost=Path(folder, "cost.json"),
        )
        ((about, (scores, *_)),) = read_measurements(tables)
        content = tables.read_bytes()
    if task_settings.kind == "regression":
        metric, scale, unit = "rmse", 1, task_settings.unit
    else:
        metric, scale, unit = "accuracy", 100, "%"
    rows = scores.where(metric=metric).rows
    parts = about.get("parts", {})
    return {
        "digest": hashlib.sha256(content).hexdigest(),
        "values": {f"{_part(row, dataset)} {row['statistic']}": row["value"] for row in rows},
        "scale": scale,
        "unit": unit,
        "recordings": {part: count["recordings"] for part, count in parts.items()},
    }


def _part(row: dict[str, Any], dataset: str) -> str:
    """Return the test recordings of a score: `grouped`, `random`, `withheld`, `on size_80dba`.

    Scores with held-out sessions begin with `session`, those of a placebo with `placebo`.
    """
    if row["target_values"] == PLACEBO_VALUES:
        return f"placebo {row['split']}"
    if row["test_set"] != dataset:
        return f"on {row['test_set']}"
    if row["split"] == SESSION_SPLIT:
        return f"session {row['target_values']}"
    if row["target_values"] == TRAINING_VALUES:
        return row["split"]
    return row["target_values"]


def measure_variant(paths: Paths, variant: str, figures: Iterable[str]) -> dict[str, Any]:
    """Return the results for some published values by experiment, and the digests of `steps`."""
    rows = [row for row in ROWS if row.figure in figures]
    results: dict[str, Any] = {"steps": steps(paths)}
    for measurement in dict.fromkeys(row.measurement for row in rows):
        if measurement.experiment == REPEATED_FITS and variant not in LONG:
            continue
        scores = [row.score for row in rows if row.measurement == measurement]
        name = "/".join(measurement)
        results[name] = measured(paths, measurement, random="random mean" in scores)
    return results


def in_process(project: Path, variant: str, figures: Iterable[str]) -> dict[str, Any]:
    """Return the result of `measure_variant` in a new process with the variables of the variant."""
    print(f"measuring: {variant}", file=sys.stderr)
    arguments = ["--project", str(project), "--names", ",".join(figures), "--variant", variant]
    variables = dict(word.split("=", 1) for word in variant.split() if "=" in word)
    process = subprocess.run(
        [sys.executable, __file__, *arguments],
        check=True,
        env={**os.environ, **variables},
        stdout=subprocess.PIPE,
    )
    return json.loads(process.stdout.splitlines()[-1])


def compared(row: MeasuredRow, runs: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return the value of a row on this computer, and its range over variants.

    `runs` are the results by variant.
    """
    name = "/".join(row.measurement)
    base = runs[HERE_RUN][name]
    results = {variant: result[name] for variant, result in runs.items() if name in result}
    values = [base["scale"] * result["values"][row.score] for result in results.values()]
    changed = [variant for variant, result in results.items() if result["digest"] != base["digest"]]
    return {
        "figure": row.figure,
        "experiment": name,
        "part": row.score,
        "unit": base["unit"],
        "value": values[0],
        "smallest": min(values),
        "largest": max(values),
        "step": step(row, base),
        "variants": len(values) - 1,
        "changed_by": changed,
    }


def step(row: MeasuredRow, result: dict[str, Any]) -> float:
    """Return the smallest possible difference of an accuracy of a trained network: one recording.

    0 for other models, which no variant changes, and for errors of numbers, which have no step.
    """
    if row.model not in NETWORKS or result["unit"] != "%":
        return 0.0
    part, _, _ = row.score.partition(" ")
    return float(result["scale"] / result["recordings"][part])


def with_spreads(content: dict[str, Any]) -> dict[str, Any]:
    """Return the content of the file with the spread of each row."""
    differences = {  # on other computers
        other["figure"]: abs(other["value"] - other["compared_with"])
        for other in content["other_machines"]
    }
    rows = []
    for row in content["rows"]:
        range_of_variants = row["largest"] - row["smallest"]
        spread = max(range_of_variants, row["step"], differences.get(row["figure"], 0.0))
        rows.append({**row, "spread": spread})
    return {**content, "rows": rows}


def markdown(content: dict[str, Any]) -> str:
    """Return the table of docs/reproducibility.md."""
    head = "published value, experiment | here | smallest | largest | spread | changed by"
    lines = [f"| {head} |", f"|{'---|' * 6}"]
    for row in content["rows"]:
        numbers = " | ".join(
            f"{row[key]:.4g}" for key in ("value", "smallest", "largest", "spread")
        )
        name = f"{row['figure']} ({row['unit']}), `{row['experiment']}`, {row['part']}"
        lines.append(f"| {name} | {numbers} | {len(row['changed_by'])} of {row['variants']} |")
    return "\n".join(lines) + "\n"


def main(
    project: Annotated[Path, typer.Option(help="folder with datasets/ and results/")] = HERE,
    names: Annotated[str, typer.Option(hidden=True)] = "",
    variant: Annotated[str, typer.Option(hidden=True)] = "",
) -> None:
    """Measure all variants, write the file of spreads, and print the table."""
    if variant:
        print(json.dumps(measure_variant(Paths(project), variant, names.split(","))))
        return
    runs = {name: in_process(project, name, PROBE) for name in VARIANTS}
    unchanged = dict(runs[HERE_RUN])
    if runs.pop(AGAIN) != unchanged:
        raise SystemExit("two unchanged runs differ: no difference is due to a variant")
    remaining = dict.fromkeys(row.figure for row in ROWS if row.figure not in PROBE)
    for name, results in runs.items():
        if name == HERE_RUN or results != unchanged:
            results.update(in_process(project, name, remaining))
    changed = {
        step: [name for name, results in runs.items() if results["steps"][step] != digest]
        for step, digest in runs[HERE_RUN]["steps"].items()
    }
    cpu_facts = CPUINFO.read_text(encoding="utf-8")
    known = re.findall(r"^(?:cpu family|model|model name)\s*: (.*)$", cpu_facts, re.MULTILINE)
    file = HERE / "reports" / MACHINE_SPREAD_FILE
    content = with_spreads(
        {
            "commit": software()["git_commit"],
            "date": f"{datetime.now(UTC):%Y-%m-%d}",
            "cpu": "family {}, model {}, {}".format(*known),
            "variants": list(VARIANTS[2:]),
            "steps": changed,
            "other_machines": read_yaml(file)["other_machines"],
            "rows": [compared(row, runs) for row in ROWS],
        }
    )
    write_bytes(file, yaml_bytes(content))
    print(markdown(content))


if __name__ == "__main__":
    typer.run(main)
