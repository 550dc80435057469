"""Every experiment on data that lack what it needs: a reason is stored, and the report comes out.

Real files, from WAV to page: a data set of short tones of which little is left, beside a whole one.
"""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml
from recorded import make_features

from ajgdata.experiments.registry import EXPERIMENTS
from ajgdata.experiments.requests import measurement_name, requests_for
from ajgdata.paths import Paths
from ajgdata.pipeline.collect import collect
from ajgdata.pipeline.experiments import run_experiment
from ajgdata.pipeline.report import build_report
from ajgdata.pipeline.train import train_embedding, train_model
from ajgdata.store.audio import write_pcm24
from ajgdata.store.features import read_store
from ajgdata.store.files import read_csv
from ajgdata.store.sessions import read_dataset, write_session
from ajgdata.store.tables import read_measurements
from ajgdata.types import AudioSettings, Recording, Session

RATE_HZ = 44_100
#: Two of one name to people where the target is a number, and one that needs several rows.
FAST = ("linear_plain", "ridge_plain", "knn")
#: One recording: class, grasp, object.
Row = tuple[str, str, str]
WHOLE = [(label, f"{label}{n}", f"{label}{n}") for n in range(8) for label in "ab"]
CASES: dict[str, list[Row]] = {
    "no recording": [],
    "one recording": [("a", "1", "a")],
    "one class": [("a", str(n), "a") for n in range(8)],
    "a class of one recording": [*WHOLE[:12], ("c", "1", "c1")],
}
#: Cases in which nothing at all can be said of a model.
HOPELESS = ("no recording", "one recording")
#: Cases of which a report is built, and models that are trained.
REPORTED = ("no recording", "a class of one recording")
TRAINED = ("cnn", "linear", "knn_plain", "svm_plain")
SETTINGS: dict[str, dict] = {
    "learning_curve": {"groups": [1, 2], "repeats": 2, "models": ["ridge"]},
    "sorting": {"models": ["linear_plain"]},
    "cross_gripper": {"test_on": ["whole"], "grasps": [0, 1], "models": ["knn"]},
    "reflected_energy": {"reference": "a", "band_hz": [100, 3000]},
    "variants": {
        "files": {
            "windows": {
                "title": "Windows",
                "question": "Does the window matter?",
                "train": "little",
                "task": "classification",
                "test": ["whole"],
                "models": ["knn"],
                "variants": {"own": {}, "short": {"features": {"window": 128, "hop": 64}}},
            }
        }
    },
    "shortcut": {"test_on": ["whole"], "models": ["knn"]},
    "transfer": {"leave_out": "object", "normalise": ["none"], "models": ["knn"]},
    "repeated_fits": {"test_on": ["whole"], "repeats": 3, "models": ["ridge_plain"]},
    "conformal_intervals": {"models": ["linear_plain"]},
    "novel_objects": {},
}
EMBEDDED = {"supervision": "by hand", "target": "label", "dimensions": [2], "shown": 2}
EMBEDDED |= {"folds": 2, "inits": 1, "epochs": 1}


def declaration(name: str) -> dict:
    """Every experiment on classes and on numbers, and an embedding of either sort."""
    named = {n: s for n, s in SETTINGS.items() if not EXPERIMENTS[n].of_embedding}
    tasks = {
        kind: {
            "target": target,
            "folds": 3,
            "models": list(FAST),
            "compare_random": True,
            "test_on": ["whole"],
            "experiments": {n: s for n, s in named.items() if kind in EXPERIMENTS[n].kinds},
        }
        for kind, target in (("classification", "label"), ("regression", "size"))
    }
    own = {"tasks": tasks, "embeddings": {"alone": EMBEDDED}}
    return {
        "name": name,
        "audio": {"sample_rate_hz": RATE_HZ},
        "features": {"window": 256, "hop": 128, "quantity": "power", "normalisation": "none"},
        "targets": {"label": {"kind": "classification"}, "size": {"kind": "regression"}},
    } | (own if name == "little" else {})


def make_dataset(paths: Paths, name: str, rows: list[Row]) -> None:
    """Declare a data set, record it, and bring it to its store."""
    folder = paths.session(name, "s1")
    paths.dataset(name).parent.mkdir(parents=True)
    paths.dataset(name).write_text(yaml.safe_dump(declaration(name)))
    recordings = []
    for number, (label, grasp, held) in enumerate(rows or [("a", "1", "a")]):
        file = f"audio/{number}.wav"
        labels = {
            "label": label,
            "size": "7" if name == "little" and len(rows) > 7 else str(number),
        }
        t = np.arange(2_000) / RATE_HZ
        tone = np.sin(2 * np.pi * (1900 if label == "a" else 5500) * t + number)
        noise = np.random.default_rng([len(name), number]).normal(0, 0.05, len(t))
        write_pcm24(folder / file, 0.4 * tone + noise, RATE_HZ)
        about = {"grasp_id": grasp, "object": held, "quality": "ok" if rows else "reject"}
        recordings.append(Recording(recording_id=str(number), file=file, labels=labels, **about))
    write_session(folder, Session(session_id="s1", source="import"), recordings)
    make_features(paths, name)


def played(names, sounds) -> Iterator[list[np.ndarray]]:
    """A scene that changes nothing but a little noise."""
    for number, _ in enumerate(names):
        noise = np.random.default_rng(number).normal(0, 0.01, RATE_HZ)
        yield [sound + noise[: len(sound)] for sound in sounds]


def measure_all(paths: Paths) -> dict[tuple[str, str], str]:
    """Run every job of `little`; returns why each was skipped ("" if it was not), by task and
    measurement."""
    spec = read_dataset(paths, "little")
    for name, settings in spec.embeddings.items():
        train_embedding(
            paths.features("little"),
            settings=settings,
            seed=0,
            latents=paths.latents("little", name),
            cost=paths.training_cost("little", name),
        )
    skipped = {}
    for item in requests_for(
        {"little": spec}, [("little", t) for t in (*spec.tasks, *spec.embeddings)]
    ):
        encoders = [paths.latents("little", item.task), paths.training_cost("little", item.task)]
        for job in item.jobs:
            measured = item.of_job(job[-1])
            tables = paths.experiment(*job)
            run_experiment(
                paths.features("little"),
                dataset="little",
                task=item.task,
                experiment=item.experiment.name,
                parts=measured.part_names,
                settings=measured.job_settings(),
                task_settings=spec.task_settings(item.task),
                other_sets=list(item.other_sets),
                rendered="x" if item.experiment.renders else "",
                audio=AudioSettings(sample_rate_hz=RATE_HZ),
                features=spec.features,
                paths=paths,
                encoders=encoders if item.experiment.of_embedding else [],
                seed=0,
                tables=tables,
                cost=paths.experiment_cost(*job),
            )
            for model, (about, _) in zip(
                measured.part_names, read_measurements(tables), strict=True
            ):
                skipped[item.task, measurement_name(item.experiment.name, model)] = about.get(
                    "skipped", ""
                )
    return skipped


def report(paths: Paths) -> dict[str, str]:
    """All that follows from the results; returns the pages by name."""
    specs = {name: read_dataset(paths, name) for name in ("little", "whole")}
    tasks = [("little", t) for t in (*specs["little"].tasks, *specs["little"].embeddings)]
    collect(paths, datasets=list(specs), tasks=tasks)
    build_report(paths, datasets=list(specs), tasks=tasks, requested=[])
    return {page.name: page.read_text() for page in paths.report.parent.glob("*.html")}


@pytest.mark.parametrize("case", REPORTED)
def test_what_cannot_be_measured_is_told_and_the_report_comes_out(tmp_path, monkeypatch, case):
    monkeypatch.setattr("ajgdata.report.canvas.FIGURE_FORMATS", ("svg",))  # three times as fast
    monkeypatch.setattr("ajgdata.pipeline.experiments.renderer", lambda *_: played)
    paths = Paths(tmp_path)
    make_dataset(paths, "whole", WHOLE)
    make_dataset(paths, "little", CASES[case])
    outcomes = measure_all(paths)
    reasons = {key: why for key, why in outcomes.items() if why}
    assert all(len(why) > 20 and "\n" not in why for why in reasons.values())
    if case in HOPELESS:
        assert len(reasons) == len(outcomes)
    pages = report(paths)
    section = pages["run.html"].partition("Skipped measurements")[2].partition("</ul>")[0]
    assert section.count("<li>") == len(reasons)
    for row in read_csv(paths.metrics_table)[1]:
        assert row["value"] or row["reason"], str(row)


@pytest.mark.parametrize("case", ["one recording", "one class"])
def test_a_model_that_cannot_be_trained_says_why(tmp_path, case):
    paths = Paths(tmp_path)
    make_dataset(paths, "whole", WHOLE)
    make_dataset(paths, "little", CASES[case])
    spec = read_dataset(paths, "little")
    for task in spec.tasks:
        for model in TRAINED:
            folder = paths.model("little", task, model)
            train_model(
                read_store(paths.features("little")),
                spec.training(task),
                model=model,
                seed=0,
                folder=folder,
            )
            (about,) = (json.loads(path.read_text()) for path in folder.glob("*.json"))
            if case in HOPELESS:
                assert len(about["skipped"]) > 20
            assert ("skipped" in about) != (len(list(Path(folder).iterdir())) > 1)
