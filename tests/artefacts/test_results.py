"""Results of the workflow are consistent: run `pytest -m artefact tests/artefacts` after a run.

The variable AJGDATA_RUN names a run of selected data sets (folder below `results/runs`).
"""

import csv
import json
import os
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from sklearn.metrics import accuracy_score, root_mean_squared_error

import ajgdata
from ajgdata.evaluate.parts import part_columns
from ajgdata.experiments.requests import requested_experiments
from ajgdata.paths import Paths, Tree
from ajgdata.pipeline.studies import STUDIES as STUDY_NAMES
from ajgdata.pipeline.task_results import measurements
from ajgdata.report.study_tables import holds
from ajgdata.store.audio import read_audio
from ajgdata.store.features import read_store
from ajgdata.store.publishing.archive import checksums_bytes
from ajgdata.store.sessions import (
    audio_path,
    list_sessions,
    read_dataset,
    read_recordings,
    read_session,
)
from ajgdata.store.tables import read_tables
from ajgdata.types import DataError
from ajgdata.types.table import Table

pytestmark = pytest.mark.artefact

#: Recordings that predictors are asked about at most: each is a hundredth of a second.
MOST_ASKED = 2_000
PATHS = Paths(run=os.environ.get("AJGDATA_RUN", ""))
#: Splits whose every test part is of one session.
EMPTY: dict[str, list] = {"datasets": [], "runs": [], "pages": [], "published": []}
#: Only what this run is about: results of what was declared once may still lie about.
RUNS = json.loads(PATHS.runs.read_text()) if PATHS.runs.is_file() else EMPTY
STORES = [PATHS.features(name) for name in RUNS["datasets"]]
EVALUATED = [(d, task, "cross_validation", model) for d, task, model in RUNS["runs"]]
TREES = [PATHS.published(name) for name in RUNS["published"]]
OWN = sorted(PATHS.report.parent.glob("experiments/*.html"))
COMPARED = ["paper"] if RUNS.get("agreements") else []
FIXED = [PATHS.report.with_name(f"{n}.html") for n in (*COMPARED, "datasets", "run")]
PAGES = [PATHS.report, *FIXED, *OWN, *(PATHS.page(name) for name in RUNS["pages"])]
#: Every model of the first task of two data sets.
IN_USE = [
    run
    for name in list(dict.fromkeys(d for d, _, _ in RUNS["runs"]))[:2]
    for run in RUNS["runs"]
    if run[:2] == next(r for r in RUNS["runs"] if r[0] == name)[:2]
]
STUDIES = [PATHS.study(name) for name in RUNS["pages"] if name in STUDY_NAMES]


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_something_was_built():
    assert STORES
    assert PATHS.report.is_file()


@pytest.mark.parametrize("path", TREES, ids=lambda p: p.stem)
def test_what_is_published_is_whole_and_of_these_results(path):
    assert (path / Tree.SUMS).read_bytes() == checksums_bytes(path)
    assert (path / Tree.FEATURES).read_bytes() == PATHS.features(path.name).read_bytes()


@pytest.mark.parametrize("path", STORES, ids=lambda p: p.stem)
def test_stored_spectra_are_finite_and_normalised(path):
    with ajgdata.load_features(path.stem, PATHS.root) as store:
        feature = store["feature"].values
        settings = json.loads(store.attrs["settings"])["features"]
    assert feature.dtype == np.float32
    assert np.isfinite(feature).all()
    assert (feature >= 0).all()
    if settings["normalisation"] == "l1":
        # a float32 sum of n values rounded to 2**-24 each errs by at most n 2**-24 of itself
        error = feature.shape[1] * 2**-24
        np.testing.assert_allclose(feature.sum(axis=1, dtype=np.float64), 1, atol=error)


@pytest.mark.parametrize("path", STORES, ids=lambda p: p.stem)
def test_every_recording_is_in_the_store_or_in_the_quarantine(path):
    name = path.stem
    declared = {
        f"{session}/{row['recording_id']}"
        for session in list_sessions(PATHS, name)
        for row in rows_of(PATHS.recordings_file(name, session))
    }
    stored = set(read_store(path).columns["recording"].values.tolist())
    listed = {
        f"{row['session_id']}/{row['recording_id']}" for row in rows_of(PATHS.quarantine(name))
    }
    assert stored <= declared
    assert declared - stored <= listed


def evaluation(
    dataset: str, task: str, experiment: str, model: str
) -> tuple[dict, dict[str, Table]]:
    requests = requested_experiments(read_dataset(PATHS, dataset), task)
    measurement = measurements(PATHS, requests)[0][dataset, task, experiment, model]
    return measurement.about, {table.name: table for table in measurement.tables}


@pytest.mark.parametrize("key", EVALUATED, ids="-".join)
def test_reported_errors_follow_from_the_predictions(key):
    about, tables = evaluation(*key)
    if "skipped" in about:
        assert len(about["skipped"]) > 10
        return
    for part, counts in about["parts"].items():
        columns = part_columns(part, about["dataset"])._asdict()
        folds = {}
        for row in tables["predictions"].where(**columns).rows:
            folds.setdefault(int(row["fold"]), []).append((row["y_true"], row["y_pred"]))
        assert len(folds) == counts["folds"]
        errors = []
        numbers = about["kind"] == "regression"
        for _, pairs in sorted(folds.items()):
            true, predicted = zip(*pairs, strict=True)
            if numbers:
                true, predicted = (np.asarray(values, float) for values in (true, predicted))
                period = about["period_deg"]
                if period:  # the prediction's nearest repetition
                    predicted = predicted - period * np.round((predicted - true) / period)
                errors.append(root_mean_squared_error(true, predicted))
            else:
                errors.append(accuracy_score(true, predicted))
        name = "rmse" if numbers else "accuracy"
        scores = tables["scores"].where(**columns, metric=name)
        statistics = dict(zip(scores.column("statistic"), scores.numbers("value"), strict=True))
        per_fold = [statistics[f"fold {n}"] for n in range(len(errors))]
        # An error of nothing but rounding (k-NN that is right) is some ε of the values themselves.
        atol = 1e-12 * max(1.0, np.max(np.abs(true))) if numbers else 0.0
        near = {"rtol": 1e-9, "atol": atol}
        np.testing.assert_allclose(per_fold, errors, **near)
        np.testing.assert_allclose(statistics["mean"], np.mean(errors), **near)
        np.testing.assert_allclose(statistics["sd"], np.std(errors, ddof=1), **near)


def groups_of(dataset: str, column: str) -> dict[str, object]:
    columns = read_store(PATHS.features(dataset)).columns
    names = columns["recording"].values.tolist()
    return dict(zip(names, columns[column].values.tolist(), strict=True))


@pytest.mark.parametrize("key", EVALUATED, ids="-".join)
def test_no_group_is_trained_on_where_it_is_tested(key):
    """Neither among the folds, nor where withheld values or other data sets are tested."""
    about, tables = evaluation(*key)
    column = about["groups"]
    groups = groups_of(key[0], column)
    rows = tables["predictions"].where(split="grouped").rows if tables else ()
    fold_of = {}
    for row in rows:
        if (row["test_set"], row["target_values"]) == (key[0], "training"):
            assert fold_of.setdefault(groups[row["recording"]], row["fold"]) == row["fold"]
    theirs = {name: groups_of(name, column) for name in {row["test_set"] for row in rows}}
    for row in rows:
        group = theirs[row["test_set"]][row["recording"]]
        assert fold_of.get(group, row["fold"]) == row["fold"]


@pytest.mark.parametrize("path", PAGES, ids=lambda p: p.stem)
def test_each_page_needs_no_network_and_what_it_links_to_is_there(path):
    page = path.read_text(encoding="utf-8")
    for tag, source in re.findall(r"<(\w+)[^>]+\bsrc(?:set)?=[\"']([^\"']+)", page):
        assert tag in ("img", "audio", "source"), tag
        assert (path.parent / source).is_file(), source
    assert not re.search(r"@import|url\(\s*[\"']?http|<link[^>]+href=[\"']http", page)
    links = re.findall(r"href=\"(?!https?:|#)([^\"]+)\"", page)
    assert links
    for link in links:
        name, _, anchor = link.partition("#")
        there = path.parent / name
        assert there.is_dir() if name.endswith("/") else there.is_file(), link
        assert not anchor or f'id="{anchor}"' in there.read_text(encoding="utf-8"), link


@pytest.mark.parametrize("path", STUDIES, ids=lambda p: p.stem)
def test_what_the_studies_claim_holds(path):
    _, tables = read_tables(path)
    assert tables
    for table in tables:
        assert table.rows
        assert [row for row in table.rows if holds(row) is False] == []


@pytest.mark.skipif(not PATHS.metrics_table.is_file(), reason="no table was asked for")
def test_all_results_are_within_bounds():
    shares = ("accuracy", "balanced_accuracy", "macro_f1", "p", "share", "calibration_error")
    for row in rows_of(PATHS.metrics_table):
        where = tuple(row.values())
        if not row["value"]:
            assert row["reason"], where  # undefined, not left out
            continue
        value = float(row["value"])
        assert np.isfinite(value), where
        share = row["metric"] in shares or row["metric"].startswith(("accuracy of", "precision at"))
        if row["statistic"] != "sd" and share:
            assert 0 <= value <= 1, where
        if row["metric"] == "silhouette":
            assert -1 <= value <= 1, where
        if row["metric"].split(" of ")[0] == "r2" and row["statistic"] not in ("sd",):
            assert value <= 1, where
        if row["metric"] in ("rmse", "mae", "distance") or row["statistic"] == "cost":
            assert value >= 0, where


@pytest.mark.parametrize("run", IN_USE, ids="-".join)
def test_a_predictor_says_of_every_recording_what_the_model_says_of_its_features(run):
    """Samples give the stored feature; a feature gives the same prediction alone, among others and
    by the stored model. Of many recordings MOST_ASKED, evenly."""
    dataset, task, model = run
    try:
        predictor = ajgdata.load_predictor(dataset, task, model, PATHS.root)
    except DataError as error:
        assert "was not trained" in str(error) or "needs the played sound" in str(error)
        return
    store = read_store(PATHS.features(dataset))
    waveform = samples_of(dataset)
    rows = evenly(store.columns["recording"].values)
    stored = store.feature[rows]
    rate_hz = predictor.sample_rate_hz
    samples = [waveform[name] for name in store.columns["recording"].values[rows].tolist()]
    feature = np.array([predictor.feature(sound, rate_hz) for sound in samples])
    # rounding of a transform spreads over the bins: its error is a share of their sum
    np.testing.assert_allclose(feature, stored, rtol=1e-3, atol=1e-6 * stored.sum(axis=1).max())
    value = ajgdata.load_model(dataset, task, model, PATHS.root).predict(stored)
    assert_same(value, predictor.of_features(stored), predictor)
    together = predictor.of_features(feature)
    alone = [predictor.predict(sound, rate_hz) for sound in samples]
    assert [answer.verdict for answer in alone] == [answer.verdict for answer in together]
    assert_same([answer.value for answer in alone], together, predictor)


def assert_same(values, predictions, predictor):
    """Assert that predictions have these values, unless two classes are equally probable."""
    scale = 1e-3 * np.abs(values).max() if predictor.kind == "regression" else 0
    period = getattr(predictor.estimator, "period", np.inf)
    for value, other in zip(values, predictions, strict=True):
        if predictor.kind == "regression":
            off = abs(value - other.value)
            assert min(off, abs(period - off)) <= scale
        elif value != other.value:
            assert other.probability[other.value] - other.probability[value] < 1e-3


def evenly(rows: np.ndarray) -> np.ndarray:
    """Numbers of MOST_ASKED of `rows` (n,) at even distances; of all, if there are no more."""
    return np.linspace(0, len(rows) - 1, min(len(rows), MOST_ASKED)).round().astype(int)


@cache
def samples_of(dataset: str) -> dict[str, np.ndarray]:
    """Samples (n,) of the recordings that are asked about, by name."""
    audio = read_dataset(PATHS, dataset).audio
    samples = {}
    rows = read_store(PATHS.features(dataset)).columns["recording"].values
    names = [name.partition("/") for name in rows[evenly(rows)].tolist()]
    for session in sorted({name[0] for name in names}):
        folder = PATHS.session(dataset, session)
        declared = read_session(folder)
        rows = read_recordings(folder)[0]
        by_id = {row.recording_id: row for row in rows}
        for own, _, recording in names:
            if own == session:
                file = audio_path(folder, declared, by_id[recording])
                samples[f"{session}/{recording}"] = read_audio(file, audio).samples
    return samples


#: Sizes of a report on everything: words in all, words of a page on an experiment, figures that are
#: not folded, and bytes.
MAX_WORDS = 25_000
MAX_PAGE_WORDS = 900
MAX_OPEN_FIGURES = 110
MAX_BYTES = 20_000_000


def body(path: Path, *, folded: bool) -> str:
    """The content of a page, without navigation, with or without what is folded."""
    html = re.sub(r"<nav.*?</nav>|<style.*?</style>", "", path.read_text("utf-8"), flags=re.S)
    return html if folded else re.sub(r"<details>.*?</details>", "", html, flags=re.S)


def word_count(html: str) -> int:
    return len(re.sub(r"<[^>]+>", " ", html).split())


def test_the_report_is_short():
    words = {path.name: word_count(body(path, folded=True)) for path in PAGES}
    assert sum(words.values()) <= MAX_WORDS, words
    open_words = {path.name: word_count(body(path, folded=False)) for path in OWN}
    assert {name: n for name, n in open_words.items() if n > MAX_PAGE_WORDS} == {}
    figures = {path.name: body(path, folded=False).count("<img") for path in PAGES}
    assert sum(figures.values()) <= MAX_OPEN_FIGURES, figures
    assert {name: figures[name] for name in open_words if figures[name] > 4} == {}
    files = PATHS.report.parent.rglob("*")
    assert sum(file.stat().st_size for file in files if file.is_file()) <= MAX_BYTES
