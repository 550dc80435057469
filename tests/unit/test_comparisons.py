"""Comparisons of features and played sounds: files of the project, and scores."""

import numpy as np
import pytest
from result_samples import sizes
from worlds import AUDIO as SMALL_AUDIO
from worlds import RATE_HZ

from ajgdata.acquire.excitation import excitation_samples
from ajgdata.evaluate.crossval import cross_validate
from ajgdata.experiments import EXPERIMENTS, requested_experiments
from ajgdata.experiments.base import Inputs, Result, TaskResults
from ajgdata.experiments.comparison import Settings, check, errors, features_of, measure
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.features.spectrum import spectrum
from ajgdata.pipeline.recipes import acquire_virtual, renderer
from ajgdata.pipeline.recordings import RecordingReader
from ajgdata.store.audio import read_audio, write_pcm24
from ajgdata.store.features import FeatureColumn, FeatureRows, text_column
from ajgdata.store.sessions import read_dataset, read_recordings
from ajgdata.types import (
    AudioSettings,
    DataError,
    FeatureSettings,
    LogSweep,
    TaskSettings,
)
from ajgdata.types.comparison import Comparison

EXPERIMENT = EXPERIMENTS["comparison"]
EDGE = TaskSettings(target="edge_mm", kind="regression", unit="mm", groups="grasp_id", folds=3)
AUDIO, RATE = AudioSettings(), 44_100
RECIPE = {
    "grasps_per_object": 3,
    "samples_per_grasp": 2,
    "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.006}},
    "vary": {"angle_deg": [-10, 10]},
    "objects": [
        {"name": f"cube_{edge}", "shape": {"kind": "cube", "edge_mm": edge},
         "targets": {"edge_mm": edge}}
        for edge in (12, 28)
    ],
}  # fmt: skip


@pytest.fixture
def recorded(project) -> Inputs:
    """A task on a data set that the virtual gripper recorded."""
    project.declare(audio={}, features={}, recipe=RECIPE)
    acquire_virtual(project.paths, "d", "virtual-01")
    folder = project.paths.session("d", "virtual-01")
    rows = read_recordings(folder)[0]
    samples = [read_audio(folder / row.file, AUDIO).samples for row in rows]
    columns = {
        "recording": text_column([f"virtual-01/{row.recording_id}" for row in rows]),
        "grasp_id": text_column([f"virtual-01/{row.grasp_id}" for row in rows]),
        "edge_mm": FeatureColumn(np.array([float(row.labels["edge_mm"]) for row in rows])),
    }
    feature = np.array([spectrum(signal, RATE, FeatureSettings()) for signal in samples])
    attrs = {"data_set": "d", "source": "simulated", "git_commit": "", "settings": "{}"}
    shard = FeatureRows(feature, np.fft.rfftfreq(2048, 1 / RATE), columns, attrs)
    return Inputs(
        "d", "t", EDGE, 0, shard, audio=AUDIO,
        render=renderer(project.paths, "d"),
    )  # fmt: skip


SOUNDS = Settings(
    comparisons={
        "sounds": Comparison(
            title="Sounds",
            question="Which?",
            train="d",
            task="t",
            axis="excitation.length_s",
            name="excitation:{kind} {length_s:g} s",
            vary={"excitation.kind": ["log_sweep", "mls"], "excitation.length_s": [1.0, 0.1]},
            models=["linear_plain"],
        )
    }
)


def test_other_sounds_are_played_in_the_same_scenes(recorded):
    outcome = measure(recorded, SOUNDS, "sounds")
    scores, data = outcome.tables[0], recorded.data()
    own = cross_validate(
        data.feature,
        data.value,
        data.group,
        model="linear_plain",
        kind="regression",
        folds=3,
        seed=0,
    )
    names = dict.fromkeys(scores.column("condition"))
    sweeps = [f"excitation:log_sweep {n} s" for n in ("1", "0.1")]
    assert list(names) == [*sweeps, "excitation:mls 1 s", "excitation:mls 0.1 s"]
    table = scores.where(condition=sweeps[0], metric="rmse", statistic="mean")
    assert table.column("value") == [own.scores.mean["rmse"]]


FEATURES = FeatureSettings(window=256, hop=64)
SWEEP = LogSweep(length_s=0.5, low_hz=100, high_hz=3_500, amplitude=0.4)
QUANTITIES = Settings(
    comparisons={
        "quantities": Comparison(
            title="Quantities",
            question="Which?",
            train="d",
            task="t",
            models=["ridge_plain"],
            variants=[
                {"name": "feature:own"},
                {"name": "feature:power", "features": {"quantity": "power"}},
            ],
        )
    },
)
NAMES = [f"s1/r{n:02d}" for n in range(24)]


def echo(number: int, played: np.ndarray) -> np.ndarray:
    """An echo whose delay is the size that is to be read: 1 to 12 samples."""
    late = 1 + number // 2
    sound = played.copy()
    sound[late:] += 0.5 * played[:-late]
    return sound + 1e-4 * np.random.default_rng(number).standard_normal(len(played))


@pytest.fixture
def echoes(project) -> Inputs:
    """Inputs of twelve grasps of two recordings each."""
    played = excitation_samples(SWEEP, RATE_HZ)
    rows = project.session("s1", {name.partition("/")[2]: 500.0 for name in NAMES})
    for n, row in enumerate(rows):
        write_pcm24(project.folder() / row.file, echo(n, played) / 2, RATE_HZ)
    rows = [row.model_copy(update={"sha256": ""}) for row in rows]
    project.write(rows, excitation=project.excitation("s1", played))
    grasp = np.arange(24) // 2
    columns = {
        "recording": text_column(NAMES),
        "grasp_id": text_column([f"s1/g{n}" for n in grasp]),
        "edge_mm": FeatureColumn(1.0 + grasp, {"units": "mm"}),
    }
    attrs = {"data_set": "d", "source": "simulated", "settings": "{}"}
    store = FeatureRows(np.ones((24, 129), np.float32), np.arange(129.0), columns, attrs)
    return Inputs(
        "d", "t", EDGE, 0, store, audio=SMALL_AUDIO,
        features=FEATURES, recordings=RecordingReader(project.paths, {"d": SMALL_AUDIO}),
    )  # fmt: skip


def test_the_errors_are_those_of_features_made_alone(echoes):
    outcome = measure(echoes, QUANTITIES, "quantities")
    data, recordings = echoes.data(), echoes.recordings
    for variant in QUANTITIES.comparisons["quantities"].all_variants:
        own = features_of(variant, FEATURES)
        samples = recordings.samples("d", NAMES, 256)
        feature = np.array([spectrum(signal, RATE_HZ, own) for signal in samples])
        alone = cross_validate(
            feature, data.value, data.group, kind="regression", model="ridge_plain", folds=3, seed=0
        )
        scores = outcome.tables[0].where(condition=variant.name, metric="rmse", statistic="mean")
        assert scores.numbers("value")[0] == pytest.approx(alone.scores.mean["rmse"], rel=1e-9)
    times = outcome.cost[0].where(metric="feature_s_per_recording")
    assert len(times.rows) == 2 and (times.numbers("value") > 0).all()


# Files of the project


def declare(project, **changes):
    content = {"title": "T", "question": "Q?", "train": "d", "task": "edge", "models": "[knn]"}
    content |= {"variants": "[{name: a}, {name: b, features: {window: 512}}]"} | changes
    folder = project.paths.comparisons
    folder.mkdir(parents=True, exist_ok=True)
    text = "".join(f"{key}: {value}\n" for key, value in content.items())
    (folder / "knn.yaml").write_text(text)


def test_a_comparison_is_one_file(project):
    tasks = {"edge": {"target": "edge_mm", "models": []}}
    project.declare(tasks=tasks)
    declare(project)
    entry = requested_experiments(read_dataset(project.paths, "d"), "edge")[-1]
    # its name is not that of the model
    assert (
        entry.jobs == [("d", "edge", "comparison", "knn")]
        and entry.label("knn", "regression") == "T"
    )
    assert list(entry.job_settings("knn")["comparisons"]) == ["knn"]
    declare(project, task="none")
    with pytest.raises(DataError, match="there is no task 'none'"):
        read_dataset(project.paths, "d")


def test_variants_that_cannot_be_are_refused():
    keys = {"title": "T", "question": "Q", "train": "d", "task": "t"}
    wrong = Comparison(**keys, vary={"features.window": [128, 512]}, variants=[])
    with pytest.raises(ValueError, match="comparison s, window 128: hop 256 exceeds window 128"):
        check(Settings(comparisons={"s": wrong}), "regression", FeatureSettings(hop=256))


# Titles


def compared(axis="", **values: tuple[float, ...]) -> TaskResults:
    """Return a comparison of variants by k-NN: the values of two folds each."""
    key = ScoreKey("knn", "grouped", "size", comparison="s")
    rows = [
        ScoreRow("rmse", statistic, value, key._replace(condition=variant))
        for variant, folds in values.items()
        for statistic, value in {
            **{f"fold {n}": v for n, v in enumerate(folds)},
            "chance": 9,
        }.items()
    ]
    variants = [{"name": name, "x": n} for n, name in enumerate(("a", "b", "c"))]
    vary = {"vary": {axis: [1, 2]}, "axis": axis} if axis else {"variants": variants}
    comparison = Comparison(title="T", question="Q", train="d", task="t", **vary)
    about = {"parts": {}}
    result = Result(
        "s", "T", about, {"scores": score_table(rows, "T")}, {"scores": score_table((), "T")}
    )
    settings = Settings(comparisons={"s": comparison})
    return sizes(result, settings=settings, experiment="comparison")


@pytest.mark.parametrize(
    ("values", "title"),
    [
        ({"a": (1, 3), "b": (3, 3), "c": (4, 6)},
         "k-NN: RMSE 2 mm with a, 3 to 5 mm with other variants"),
        ({"a": (1, 3), "b": (3, 3)}, "k-NN: RMSE 2 mm with a, 3 mm with b"),
        ({"b": (3, 3), "c": (4, 6)}, "RMSE: 3 to 5 mm in 2 cases"),
        ({"a": (1, 3)}, "k-NN, a: RMSE 2 mm"),
    ],
    ids=["all", "two", "without the reference", "the reference only"],
)  # fmt: skip
def test_the_title_has_the_reference_and_the_range_of_the_variants(values, title):
    (figure,) = EXPERIMENT.figures(compared(**values))
    assert figure.title == title


def test_the_axis_is_named_by_the_end_of_its_key():
    titles = {key: errors_title(key) for key in ("excitation.length_s", "features.hop")}
    assert titles == {"excitation.length_s": ("Length", "s"), "features.hop": ("hop", "")}


def errors_title(key: str) -> tuple[str, str]:
    """Return title and unit of the axis in the table of a comparison over `key`."""
    results = compared(key)
    table = errors(results.results[0], results)
    return next((column.title, column.unit) for column in table.columns if column.key == "x")
