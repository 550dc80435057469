"""Tables of features without recordings: planted scores, publishing, and commands without sound."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import yaml
from recorded import make_features, run_experiments

import ajgdata as package
from ajgdata.pipeline.dataset_summary import sound_links, summary
from ajgdata.pipeline.fetch import fetch
from ajgdata.pipeline.publish import publish
from ajgdata.store.features import read_store
from ajgdata.store.sessions import read_dataset, read_recordings
from ajgdata.store.tables import read_measurements
from ajgdata.types import DataError

COUNT = 60
LABELS = np.array(["contact", "no_contact", "edge"])


def write_tables(src, *, shift: int = 0) -> None:
    """Write the tables of two days: 53 features with different units, and two labels.

    Features 7 to 26, which have the smallest unit, determine the simplified label. The original
    label has no effect. On the second day, each class has the features of the class `shift` places
    later.
    """
    units = np.full(53, 1e4)
    units[7:27] = 1e-3
    for day in (1, 2):
        generator = np.random.default_rng(day)
        classes = np.arange(COUNT) % 3
        values = generator.normal(size=(COUNT, 53))
        effect = (classes + shift * (day - 1)) % 3
        values[:, 7:17] += 30 * (effect == 1)[:, np.newaxis]
        values[:, 17:27] += 30 * (effect == 2)[:, np.newaxis]
        table = pd.DataFrame(values * units, columns=[f"feature_{n}" for n in range(53)])
        table["simplified_label"] = LABELS[classes]
        table["original_label"] = LABELS[generator.permutation(classes)]
        table["point_index"] = np.arange(COUNT) // 6
        src.mkdir(exist_ok=True)
        table.to_csv(src / f"day{day}.csv", index=False)


def import_days(ajgdata, src, *options: str) -> None:
    """Import the tables of both days."""
    for day in (1, 2):
        printed = ajgdata("import", "--features", src / f"day{day}.csv", "--dataset", "t", *options)
        assert printed.code == 0, printed.text


def edit(paths, **keys) -> None:
    """Change keys of dataset.yaml."""
    content = yaml.safe_load(paths.dataset("t").read_text())
    paths.dataset("t").write_text(yaml.safe_dump({**content, **keys}))


def accuracies(paths) -> dict[tuple[str, str], float]:
    """Run all experiments; return the mean accuracy by task and split."""
    found = {}
    for request in run_experiments(paths, "t"):
        for job in request.jobs:
            for _, tables in read_measurements(paths.experiment(*job)):
                (table,) = [table for table in tables if table.name == "scores"]
                for row in table.where(metric="accuracy", statistic="mean").rows:
                    found[request.task, row["split"]] = row["value"]
    return found


@pytest.mark.parametrize(
    ("shift", "across"), [pytest.param(0, 1.0, id="equal days"), pytest.param(1, 0.0, id="shifted")]
)
def test_the_planted_effect_decides_the_scores(src, paths, ajgdata, shift, across):
    write_tables(src, shift=shift)
    import_days(ajgdata, src)
    task = {"folds": 2, "models": ["linear_plain"], "compare_sessions": False}
    tasks = {
        "days": {"target": "simplified_label", "groups": "session_id", **task},
        "nothing": {"target": "original_label", **task},
    }
    edit(paths, tasks=tasks)
    make_features(paths, "t")
    scores = accuracies(paths)
    assert scores["days", "grouped"] == across
    # Three standard deviations of the mean of 120 guesses.
    assert abs(scores["nothing", "grouped"] - 1 / 3) < 3 * np.sqrt(2 / 9 / (2 * COUNT))


def test_a_template_keeps_the_rows_of_a_grasp_in_one_fold(src, paths, ajgdata):
    write_tables(src)
    grasp = "{simplified_label}/{point_index}"
    import_days(ajgdata, src, "--grasp", grasp, "--target", "simplified_label")
    make_features(paths, "t")
    dataset = package.load_dataset("t", paths.root)
    for train, test in dataset.folds("simplified_label"):
        assert not set(train.groups) & set(test.groups)
    assert len(set(dataset.all("simplified_label").groups)) == 2 * COUNT // 2


def test_a_published_table_loads_back_equal(src, paths, ajgdata, tmp_path):
    write_tables(src)
    import_days(ajgdata, src)
    recordings = paths.recordings_file("t", "day1")
    lines = recordings.read_text().splitlines()
    lines[1] = lines[1].replace(",ok,", ",reject,")  # row 1 is not published
    recordings.write_text("\n".join(lines) + "\n")
    make_features(paths, "t")
    published = publish(paths, "t", tmp_path / "published")
    assert published.recordings == 2 * COUNT - 1
    names = {path.name for path in published.folder.iterdir()}
    assert not {"audio", "audio.zip", "figures"} & names
    assert "spectra" not in (published.folder / "README.md").read_text().lower()
    fetched = fetch(paths, str(published.folder), name="back")
    assert fetched.recordings == 2 * COUNT - 1
    make_features(paths, "back")
    first = read_store(paths.features("t"))
    again = read_store(paths.features("back"))
    assert np.array_equal(first.feature, again.feature)
    assert first.axes[0].equals(again.axes[0])
    for column in set(first.columns) - {"table_row"}:
        assert first.columns[column].values.tolist() == again.columns[column].values.tolist()
    stored = read_store(published.folder / "features.nc")
    assert stored.columns["table_row"].values.tolist() == again.columns["table_row"].values.tolist()
    rows, _ = read_recordings(paths.session("back", "day1"))
    assert [row.table_row for row in rows] == list(range(1, COUNT))


def test_commands_that_need_sound_say_so_in_one_line(src, paths, ajgdata):
    write_tables(src)
    import_days(ajgdata, src)
    (src / "wav").mkdir()
    for arguments in (
        ("import", src / "wav", "--dataset", "t"),
        ("record", "t", "--device", "none"),
        ("sense", "t", "simplified_label", "knn", "--device", "none"),
    ):
        printed = ajgdata(*arguments)
        assert printed.code == 1
        assert "t is a table of features, and has no recordings of sound" in printed.text
    with pytest.raises(DataError, match="load_recordings: t is a table of features"):
        package.load_recordings("t", paths.root)
    printed = ajgdata("check", "t", "--accept")
    assert "has a table, and no recordings to accept" in printed.text


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"recipe": {"grasps_per_object": 1, "objects": []}}, "recipe"),
        (
            {"tasks": {"a": {"target": "simplified_label", "augment": {"gain_db": [-3, 3]}}}},
            "task a: augment changes recordings, and features.kind table has none",
        ),
        ({"features": {"kind": "table"}}, "columns"),
        ({"features": {"kind": "table", "columns": ["a", "a"]}}, "lists one twice"),
    ],
)
def test_settings_that_need_sound_are_refused(src, paths, ajgdata, keys, message):
    write_tables(src)
    import_days(ajgdata, src)
    edit(paths, **keys)
    with pytest.raises(DataError) as error:
        read_dataset(paths, "t")
    assert message in str(error.value)


def test_a_report_has_no_players_and_no_spectra(src, paths, ajgdata):
    write_tables(src)
    import_days(ajgdata, src)
    make_features(paths, "t")
    paths = type(paths)(paths.root, "t")
    about = summary(paths, read_dataset(paths, "t"), read_store(paths.features("t")))
    assert (about.samples, about.spectra) == ((), None)
    assert sound_links(paths, "t")("day1/01") == ""


def test_a_corrected_label_stays_if_rows_are_added(src, paths, ajgdata):
    write_tables(src)
    table = src / "day1.csv"
    complete = table.read_text().splitlines(keepends=True)
    table.write_text("".join(complete[:31]))
    options = ("import", "--features", table, "--dataset", "t")
    assert ajgdata(*options).code == 0
    printed = ajgdata("label", "t", "day1/03", "--label", "simplified_label=contact")
    assert printed.code == 0, printed.text
    table.write_text("".join(complete))
    assert "30 added, 0 changed, 30 unchanged" in ajgdata(*options).text
    make_features(paths, "t")
    store = read_store(paths.features("t"))
    names = store.columns["recording"].values.tolist()
    labels = dict(zip(names, store.columns["simplified_label"].values.tolist(), strict=True))
    assert (labels["day1/03"], labels["day1/06"]) == ("contact", "edge")


def test_options_of_recordings_are_refused(src, ajgdata):
    write_tables(src)
    table = src / "day1.csv"
    for option, message in (
        (("--microphone", "1"), "--microphone: is for recordings"),
        (("--reference",), "--reference: is for recordings"),
        (("--pattern", "starter-kit"), "--pattern: is for recordings"),
    ):
        printed = ajgdata("import", "--features", table, "--dataset", "t", *option)
        assert printed.code == 1 and message in printed.text, printed.text
    printed = ajgdata("import", src, "--dataset", "t", "--feature-columns", "f.*")
    assert "--feature-columns: requires --features" in printed.text
    printed = ajgdata("import", "--dataset", "t")
    assert "FOLDER is missing. Name a folder with recordings, or a table" in printed.text
