"""Variants of features and played sounds: files of the project, and scores."""

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError
from result_samples import sizes
from worlds import AUDIO as SMALL_AUDIO
from worlds import RATE_HZ

from ajgdata.acquire.excitation import excitation_samples
from ajgdata.evaluate.crossval import cross_validate
from ajgdata.experiments.base import Inputs, Result, TaskResults
from ajgdata.experiments.registry import load_experiment
from ajgdata.experiments.requests import requested_experiments
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.experiments.settings import VariantsSettings
from ajgdata.experiments.variant_data import VariantRecordings
from ajgdata.experiments.variant_figures import errors
from ajgdata.experiments.variants import measure
from ajgdata.features.compute import FeatureComputer
from ajgdata.features.spectrum import spectrum
from ajgdata.pipeline.recipes import acquire_virtual, renderer
from ajgdata.pipeline.recordings import RecordingReader
from ajgdata.store.audio import read_audio, write_pcm24
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureColumn, FeatureRows, text_column
from ajgdata.store.sessions import read_dataset, read_recordings
from ajgdata.store.variants import files_without_data
from ajgdata.types import (
    AudioSettings,
    DataError,
    FeatureSettings,
    LogSweep,
    TaskSettings,
)
from ajgdata.types.features import TransferFunctionSettings
from ajgdata.types.variants import Variants

EXPERIMENT = load_experiment("variants")
EDGE = TaskSettings(target="edge_mm", kind="regression", unit="mm", groups="grasp_id", folds=3)
AUDIO = AudioSettings()
RATE = 44_100
RECIPE = {
    "grasps_per_object": 3,
    "samples_per_grasp": 2,
    "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.006}},
    "vary": {"angle_deg": [-10, 10]},
    "objects": [
        {
            "name": f"cube_{edge}",
            "shape": {"kind": "cube", "edge_mm": edge},
            "targets": {"edge_mm": edge},
        }
        for edge in (12, 28)
    ],
}


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
    shard = FeatureRows(feature, (frequency_axis(np.fft.rfftfreq(2048, 1 / RATE)),), columns, attrs)
    return Inputs(
        "d",
        "t",
        EDGE,
        0,
        shard,
        audio=AUDIO,
        render=renderer(project.paths, "d"),
    )


SOUNDS = VariantsSettings(
    files={
        "sounds": Variants(
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
    scores = outcome.tables[0]
    data = recorded.data()
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
QUANTITIES = VariantsSettings(
    files={
        "quantities": Variants(
            title="Quantities",
            question="Which?",
            train="d",
            task="t",
            models=["ridge_plain"],
            variants={
                "feature:own": {},
                "feature:power": {"features": {"quantity": "power"}},
            },
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
    store = FeatureRows(
        np.ones((24, 129), np.float32), (frequency_axis(np.arange(129.0)),), columns, attrs
    )
    return Inputs(
        "d",
        "t",
        EDGE,
        0,
        store,
        audio=SMALL_AUDIO,
        features=FEATURES,
        recordings=RecordingReader(project.paths, {"d": SMALL_AUDIO}),
    )


def test_the_errors_are_those_of_features_made_alone(echoes):
    outcome = measure(echoes, QUANTITIES, "quantities")
    data = echoes.data()
    recordings = echoes.recordings
    for variant in QUANTITIES.files["quantities"].all_variants:
        own = variant.change.feature_settings(FEATURES)
        samples = recordings.samples("d", NAMES, 256)
        feature = np.array([spectrum(signal, RATE_HZ, own) for signal in samples])
        alone = cross_validate(
            feature, data.value, data.group, kind="regression", model="ridge_plain", folds=3, seed=0
        )
        scores = outcome.tables[0].where(condition=variant.name, metric="rmse", statistic="mean")
        assert scores.numbers("value")[0] == pytest.approx(alone.scores.mean["rmse"], rel=1e-9)
    times = outcome.cost[0].where(metric="feature_s_per_recording")
    assert len(times.rows) == 2 and (times.numbers("value") > 0).all()


def test_the_reference_of_a_transfer_function_is_the_sound_of_the_session(echoes):
    """A change of the window needs the played sound, which is that of session.yaml."""
    features = TransferFunctionSettings(window=64, hop=32)
    file = Variants(
        title="T",
        question="Q?",
        train="d",
        task="t",
        vary={"features.window": [64, 128]},
        models=["ridge_plain"],
    )
    recordings = VariantRecordings(replace(echoes, features=features), file)
    first, _ = file.all_variants
    known, _ = recordings.data(first)
    compute = FeatureComputer(SMALL_AUDIO, features)
    (samples,) = echoes.recordings.samples("d", NAMES[:1], 256)
    expected = compute(samples, echoes.recordings.played("d", NAMES[0]))
    np.testing.assert_array_equal(known.feature[0], expected.values)
    assert known.feature[0].max() > 0.5


# Files of the project


def declare(project, **changes):
    content = {"title": "T", "question": "Q?", "train": "d", "task": "edge", "models": "[knn]"}
    content |= {"variants": "{a: {}, b: {features: {window: 512}}}"} | changes
    folder = project.paths.variants
    folder.mkdir(parents=True, exist_ok=True)
    text = "".join(f"{key}: {value}\n" for key, value in content.items())
    (folder / "knn.yaml").write_text(text)


def test_variants_are_one_file(project):
    tasks = {"edge": {"target": "edge_mm", "models": []}}
    project.declare(tasks=tasks)
    declare(project)
    request = requested_experiments(read_dataset(project.paths, "d"), "edge")[-1]
    # its name is that of a model, but it is no model
    assert request.jobs == [("d", "edge", "variants", "knn")]
    (part,) = request.parts
    assert (part.name, part.job, request.label(part, "regression")) == ("knn", "knn", "T")
    assert list(request.of_job("knn").job_settings()["files"]) == ["knn"]


@pytest.mark.parametrize(
    ("changes", "line", "message"),
    [
        ({"task": "none"}, 4, "there is no task 'none'. Name a task of d."),
        ({"test": "[none]"}, 7, "there is no data set 'none'. Name a data set."),
        ({"variants": "{a: {}, b: {features: {hop: 999}}}"}, 6, "hop 999 exceeds window"),
        ({"variants": "{a: {}, b: {excitation: {kind: horn}}}"}, 6, "'horn'"),
        ({"variants": "{a: {}, b: {excitation: {kind: none}}}"}, 6, "plays only computed sounds"),
        ({"variants": "{a: {}}"}, 1, "variants: give at least two, each with a name of its own"),
        ({"variants": "{a: {}, b: {task: other}}"}, 4, "there is no task 'other'"),
        ({"variants": "{a: {}, b: {grasps: {}, train: [e]}}"}, 6, "exclude each other"),
        (
            {"why": "[]"},
            7,
            "why was replaced by hypotheses. Write it as in https://ajgdata.github.io/ajgdata/variants.html.",
        ),
    ],
)
def test_a_wrong_file_is_one_line(project, changes, line, message):
    project.declare(tasks={"edge": {"target": "edge_mm", "models": []}})
    declare(project, **changes)
    with pytest.raises(DataError) as caught:
        read_dataset(project.paths, "d")
    text = str(caught.value)
    assert text.startswith(f"{project.paths.variants / 'knn.yaml'}:{line}"), text
    assert message in text
    assert "\n" not in text


def test_a_file_without_a_data_set_is_a_line_and_other_data_sets_are_read(project):
    project.declare()
    declare(project, train="none")
    assert read_dataset(project.paths, "d").name == "d"
    (line,) = files_without_data(project.paths)
    assert line.startswith(
        f"{project.paths.variants / 'knn.yaml'}:3: skipped, there is no data set"
    )


@pytest.mark.parametrize("name", ["comparisons", "ablations"])
def test_a_folder_of_an_earlier_version_is_refused(project, name):
    project.declare()
    folder = project.paths.reports / name
    folder.mkdir(parents=True)
    (folder / "old.yaml").write_text("title: T\n")
    with pytest.raises(DataError, match=f"{name} were replaced by variants") as caught:
        read_dataset(project.paths, "d")
    assert str(project.paths.variants) in str(caught.value)


def test_changes_are_combined():
    """Values of keys, changes by label, and changes of all variants."""
    content = {
        "title": "T",
        "question": "Q?",
        "train": "d",
        "task": "t",
        "axis": "shift",
        "panel": "label",
        "shared": {"grasps": {"sessions": 2, "scene": {"gripper": {"a": 1}}}},
        "vary": {
            "label": {"one": {"task": "t"}, "two": {"task": "u"}},
            "shift": {0: {}, 2.5: {"grasps": {"scene": {"gripper": {"b": 2}}}}},
            "model": ["knn", "cnn"],
        },
    }
    file = Variants.model_validate(content)
    stored = Variants.model_validate_json(file.model_dump_json())
    assert [v.change for v in stored.all_variants] == [v.change for v in file.all_variants]
    assert len(file.all_variants) == 8 and file.tasks == ("u",)
    variant = file.variant("label two, shift 2.5, model cnn")
    assert (file.x(variant), file.panel_of(variant), file.series(variant)) == (2.5, "two", "cnn")
    assert file.models_of(variant.change) == ("cnn",)
    grasps = variant.change.grasps
    assert grasps.sessions == 2 and grasps.scene == {"gripper": {"a": 1, "b": 2}}


# Titles


def compared(axis="", **values: tuple[float, ...]) -> TaskResults:
    """Return a comparison of variants by k-NN: the values of two folds each."""
    key = ScoreKey("knn", "grouped", "size", "training", comparison="s")
    rows = [
        ScoreRow("rmse", statistic, value, key._replace(condition=variant))
        for variant, folds in values.items()
        for statistic, value in {
            **{f"fold {n}": v for n, v in enumerate(folds)},
            "chance": 9,
        }.items()
    ]
    variants = {name: {} for name in ("a", "b", "c")}
    vary = {"vary": {axis: [1, 2]}, "axis": axis} if axis else {"variants": variants}
    file = Variants(title="T", question="Q", train="size", task="t", **vary)
    about = {"parts": {}}
    result = Result(
        "s", "T", about, {"scores": score_table(rows, "T")}, {"scores": score_table((), "T")}
    )
    settings = VariantsSettings(files={"s": file})
    return sizes(result, settings=settings, experiment="variants")


@pytest.mark.parametrize(
    ("values", "title"),
    [
        (
            {"a": (1, 3), "b": (3, 3), "c": (4, 6)},
            "k-NN: RMSE 2 mm with a, 3 to 5 mm with other variants",
        ),
        ({"a": (1, 3), "b": (3, 3)}, "k-NN: RMSE 2 mm with a, 3 mm with b"),
        ({"b": (3, 3), "c": (4, 6)}, "RMSE: 3 to 5 mm in 2 cases"),
        ({"a": (1, 3)}, "k-NN, a: RMSE 2 mm"),
    ],
    ids=["all", "two", "without the reference", "the reference only"],
)
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


@pytest.mark.parametrize("name", ["{}", "{hop.x}", "{window}"])
def test_a_wrong_pattern_of_names_is_one_line(name):
    content = {"title": "T", "question": "Q", "train": "d", "task": "t", "name": name}
    with pytest.raises(ValidationError, match="name: "):
        Variants.model_validate(content | {"vary": {"features.hop": [128, 256]}})


def test_a_label_with_brackets_and_dots_is_a_part_of_the_name():
    content = {"title": "T", "question": "Q", "train": "d", "task": "t"}
    labels = {"approx. x [mm]": {"0": {}, "1": {"one_recording": True}}}
    file = Variants.model_validate(content | {"vary": labels})
    assert [variant.name for variant in file.all_variants] == [
        "approx. x [mm] 0",
        "approx. x [mm] 1",
    ]
