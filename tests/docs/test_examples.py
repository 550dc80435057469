"""The examples of docstrings and of the gallery run in one project, and their numbers are right."""

import doctest
import importlib
import json
import math
import re
import runpy
import sys
import tempfile
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import scipy.stats
import soundfile
import yaml
from PIL import Image
from recorded import make_features, run_experiments

import ajgdata
from ajgdata.acquire.recipe import session_names
from ajgdata.acquire.robot import RobotGrasp, make_robot
from ajgdata.acquire.robot_numbers import number_labels
from ajgdata.paths import Paths
from ajgdata.pipeline.collect import collect
from ajgdata.pipeline.feature_table import export_table
from ajgdata.pipeline.recipes import acquire_virtual
from ajgdata.pipeline.train import train_model
from ajgdata.store.features import read_store
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DatasetSpec
from ajgdata.types.features import feature_settings
from ajgdata.types.protocol import RobotProgram
from tools import examples

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "examples"
EDGES_MM = (12.0, 18.0, 24.0, 30.0)
CUBES = [
    {
        "name": f"cube_{edge:g}",
        "shape": {"kind": "cube", "edge_mm": edge},
        "targets": {"edge_mm": edge},
    }
    for edge in EDGES_MM
]
SIZE = {
    "name": "size",
    "title": "Edge length of cubes",
    "description": "Four cubes on a coarse grid, for tests.",
    "licence": "CC0-1.0",
    "targets": {"edge_mm": {"kind": "regression", "unit": "mm", "description": "edge length"}},
    "tasks": {"size": {"target": "edge_mm", "folds": 4, "models": ["linear"]}},
    "recipe": {
        "seed": 1,
        "grasps_per_object": 4,
        "vary": {"angle_deg": [-10, 10], "offset_x_mm": [-2, 2]},
        "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.006}},
        "objects": CUBES,
    },
}
OTHER = {
    "name": "size_other_membrane",
    "from": "size",
    "title": "The same with a stiffer membrane",
    "recipe": {"scene": {"gripper": {"membrane": {"stiffness_n_m3": 400000.0}}}},
}
STEP_MM = EDGES_MM[1] - EDGES_MM[0]
MODULES = (
    "ajgdata",
    "ajgdata.acquire.robot_numbers",
    "ajgdata.cli.sense",
    "ajgdata.evaluate.agreement",
    "ajgdata.evaluate.crossval",
    "ajgdata.evaluate.intervals",
    "ajgdata.evaluate.metrics",
    "ajgdata.evaluate.parts",
    "ajgdata.evaluate.splits",
    "ajgdata.evaluate.transfer",
    "ajgdata.experiments.transfer",
    "ajgdata.features.spectrum",
    "ajgdata.gripper",
    "ajgdata.gripper.scene",
    "ajgdata.acquire.excitation",
    "ajgdata.gripper.signal_chain",
    "ajgdata.gripper.simulation",
    "ajgdata.gripper.solver_plan",
    "ajgdata.loading",
    "ajgdata.models",
    "ajgdata.paths",
    "ajgdata.pipeline.inferred_targets",
    "ajgdata.pipeline.publish",
    "ajgdata.pipeline.similar_classes",
    "ajgdata.store.audio",
    "ajgdata.store.features",
    "ajgdata.types.robot_columns",
    "ajgdata.types.session",
    "ajgdata.store.file_matching",
    "ajgdata.store.file_segments",
    "ajgdata.store.publishing.columns",
    "ajgdata.store.publishing.differences",
    "ajgdata.store.syntax",
    "ajgdata.tutorial",
    "ajgdata.types.base",
    "ajgdata.types.errors",
    "ajgdata.types.input_layout",
    "ajgdata.types.excitation",
    "ajgdata.types.table",
    "ajgdata.types.variants",
)


@pytest.fixture(scope="module")
def example_project(tmp_path_factory) -> Paths:
    """Two simulated data sets with their feature files, and a trained model."""
    paths = Paths(tmp_path_factory.mktemp("examples"))
    for declared in (SIZE, OTHER):
        path = paths.dataset(declared["name"])
        path.parent.mkdir(parents=True)
        path.write_text(yaml.safe_dump(declared, sort_keys=False))
    for name in (SIZE["name"], OTHER["name"]):
        for session in session_names(read_dataset(paths, name).recipe):
            acquire_virtual(paths, name, session)
        make_features(paths, name)
    task = read_dataset(paths, "size").training("size")
    folder = paths.model("size", "size", "ridge")
    run_experiments(paths, "size")
    collect(paths, datasets=["size"], tasks=[("size", "size")])
    train_model(read_store(paths.features("size")), task, model="ridge", seed=0, folder=folder)
    return paths


@pytest.fixture
def in_project(example_project, monkeypatch) -> None:
    """The examples' working directory."""
    monkeypatch.chdir(example_project.root)
    monkeypatch.delenv("AJGDATA_ROOT", raising=False)


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_docstrings_run(name, in_project):
    results = doctest.testmod(importlib.import_module(name))
    assert results.attempted > 0
    assert results.failed == 0


def run(name: str) -> dict:
    return runpy.run_path(str(FOLDER / f"{name}.py"))


def test_first_plot(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    example = run("first_plot")
    assert example["mean"].object.values.tolist() == ["screw", "banana"]
    assert example["mean"].frequency.values[-1] <= 6000
    with Image.open("first_plot.png") as image:
        assert image.size == (700, 400)


def test_spectrum(in_project):
    example = run("spectrum")
    assert example["mean"].edge_mm.values.tolist() == list(EDGES_MM)
    assert example["loudest_hz"] == 160 * 44_100 / 2048  # a bin of the spectrum
    with Image.open("spectrum.png") as image:
        assert image.size == (700, 400)


def test_sounds(tmp_path, monkeypatch):
    """The energy of a log sweep is equal in each octave, that of the other sounds in each hertz."""
    monkeypatch.chdir(tmp_path)
    percent = run("sounds")["percent_below_1_khz"]
    assert percent["log_sweep"] == pytest.approx(100 * math.log(50) / math.log(1000), abs=1)
    assert percent["linear_sweep"] == pytest.approx(100 * 980 / 19_980, abs=0.5)
    assert percent["mls"] == pytest.approx(100 * 1_000 / 22_050, abs=0.5)
    assert percent["noise"] == pytest.approx(100 * 1_000 / 22_050, abs=0.5)
    assert percent["file"] > 90  # a tone of 800 Hz with a width of 30 Hz


def test_settings_of_the_page_on_sounds_are_valid():
    page = (FOLDER.parent / "sounds.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```yaml\n(.*?)^```", page, flags=re.M | re.S)
    kinds = [DatasetSpec(name="d", **yaml.safe_load(block)).excitation.kind for block in blocks]
    assert kinds == ["log_sweep", "linear_sweep", "noise", "file", "none"]


def test_own_model(in_project):
    example = run("own_model")
    train, test = ajgdata.load_dataset("size").folds("size")[0]
    away = [edge - sum(train.y) / len(train.y) for edge in test.y]
    assert example["chance_mm"] == pytest.approx(math.hypot(*away) / math.sqrt(len(away)), rel=1e-5)
    # 600 steps in float32, whose sums differ between processors: only what they reach is known
    assert 0 < example["rmse_mm"] < min(STEP_MM / 2, example["chance_mm"] / 4)


def test_reviewing(capsys):
    example = run("reviewing")
    assert example["first"].recording == "takes/18_cube"
    page = (FOLDER.parent / "reviewing.md").read_text(encoding="utf-8")
    assert capsys.readouterr().out in page
    state = example["recording_state"](example["paths"], "mine", "takes/18_cube")
    assert state.labels["label"] == "cube"
    assert [change.action for change in state.history] == ["label", "undo"]


def test_versions(capsys):
    run("versions")
    page = (FOLDER.parent / "publishing.md").read_text(encoding="utf-8")
    assert f"```text\n{capsys.readouterr().out}```" in page


def test_two_grippers(in_project):
    example = run("two_grippers")
    # it reads its own gripper to half a step between cubes, and worse than that the other, which
    # still tells more than the mean edge does
    chance_mm = math.sqrt(sum((edge - 21) ** 2 for edge in EDGES_MM) / len(EDGES_MM))
    assert 0 < example["own_mm"] < STEP_MM / 2
    assert 1.5 * example["own_mm"] < example["other_mm"] < chance_mm
    train, _ = ajgdata.load_dataset("size").folds("size")[0]
    with ajgdata.load_features("size_other_membrane") as other:
        there = other.feature.mean("recording").values.astype(float)
    here = train.X.astype(float).mean(axis=0)
    apart = math.sqrt(((there - here) ** 2).sum() / (here**2).sum())
    assert example["apart"] == pytest.approx(apart, rel=1e-4) and apart > 0.05


def test_new_finger(capsys):
    example = run("new_finger")
    assert example["accuracy"]["unchanged"] < 0.6  # a guess has 1/3
    assert example["accuracy"]["normalised per finger"] > 0.98
    assert example["accuracy"]["aligned with 9 grasps"] > 0.98
    page = (FOLDER.parent / "transfer.md").read_text(encoding="utf-8")
    assert capsys.readouterr().out in page


def test_own_recordings(in_project):
    example = run("own_recordings")
    bin_hz = 48_000 / 2048
    assert set(example["rings_hz"]) == {"wood", "metal"}
    assert example["rings_hz"]["wood"] == 1500  # the 64th bin
    assert example["rings_hz"]["metal"] == 6000
    assert bin_hz * 64 == 1500
    time = example["first_tenth"].time.values
    samples = example["first_tenth"].values
    assert samples.shape == (2, 4801)
    ringing = 0.5 * np.exp(-5 * time) * np.sin(2 * np.pi * 6000 * time)
    np.testing.assert_allclose(samples[1], ringing, atol=2.0**-23)


def test_long_file():
    example = run("long_file")
    assert example["counts"] == {"none": 10, "tip": 5, "base": 5}
    assert example["grasps"] == 4
    seventh = example["seventh"]
    assert (seventh.label.item(), seventh.start_s.item(), seventh.end_s.item()) == ("tip", 6, 7)
    np.testing.assert_allclose(seventh.waveform.values, example["taps"][6], atol=2.0**-23)


def test_feature_table():
    example = run("feature_table")
    assert example["dataset"].tasks == ("simplified_label", "original_label")
    assert list(example["dataset"].spec.features.columns) == example["columns"]
    row = example["rows"][7]
    assert (row.file, row.table_row) == ("tables/day2.csv", 8)
    assert len({row.grasp_id for row in example["rows"]}) == 12
    assert row.labels == {
        "simplified_label": "no_contact",
        "original_label": "no_contact_left",
        "point_index": "1",
    }


def test_network(tmp_path, monkeypatch, capsys):
    pytest.importorskip("onnxruntime")
    monkeypatch.chdir(tmp_path)
    example = run("network")
    middle = 1 - (np.arange(10) + 0.5) / 10  # the level is the root of a sum of 4,410 squares
    np.testing.assert_allclose(example["levels"], middle * np.sqrt(4410), rtol=0.2)
    declared = yaml.safe_load(capsys.readouterr().out)["features"]
    assert feature_settings(declared) == example["settings"]


def test_publishing(in_project):
    example = run("publishing")
    assert example["done"].recordings == 16
    assert example["edges_mm"] == list(EDGES_MM)
    with ajgdata.load_features("size") as features:
        assert features.sizes["recording"] == 16


def test_parquet_table(in_project, example_project):
    export_table(example_project, "size", Path("size.parquet"))
    example = run("parquet_table")
    with ajgdata.load_features("size") as features:
        mean = features.feature.groupby("edge_mm").mean()
        loudest_hz = mean.idxmax("frequency").values.tolist()
    assert example["loudest_hz"] == dict(zip(EDGES_MM, loudest_hz, strict=True))
    assert example["unit"] == "mm"


def test_robot_numbers():
    file = FOLDER.parents[1] / "docs/examples/robot_numbers.py"
    robot = make_robot(RobotProgram(command=[sys.executable, str(file)]), print)
    assert robot.move("jam") == {}
    measured = robot.move("approach", **vars(RobotGrasp("mug_03", "mug", 3, 8.0)))
    assert number_labels(measured) == {
        "force_reached_n": "7.9",
        "robot_force_n": "7.9",
        "robot_x_m": "0.31",
        "robot_joints_rad_1": "0.1",
        "robot_joints_rad_2": "-1.2",
        "robot_joints_rad_3": "0.4",
        "robot_pressure_kpa": "101.3",
    }


def test_ros2_robot():
    example = run("ros2_robot")
    calls = []

    def answer(name, fields):
        calls.append((name, fields))
        return {"position": 0.03, "effort": 7.6, "stalled": fields.get("position") == 0}

    steps = [{"step": step} for step in ("loosen", "approach", "jam", "lift", "release", "place")]
    steps[1] |= {"object": "cube", "force_n": 8.0}
    steps[-1] |= {"bin": "A"}
    forces = [example["make_step"](answer, **step) for step in steps]
    assert forces == [None, 7.6, None, None, None, None]
    up = ("/gripper/press", {"position": 0.10, "max_effort": 50.0})
    off, on = (("/gripper/pump", {"data": data}) for data in (False, True))
    assert calls == [
        up,
        off,
        ("/gripper/press", {"position": 0.0, "max_effort": 8.0}),
        on,
        up,
        ("/gripper/press", {"position": 0.0, "max_effort": 5.0}),
        off,
        up,
        ("/bins/A", {}),
        off,
    ]
    with pytest.raises(SystemExit, match=r"met nothing at 0.001 m; put the object there"):
        example["force_of"]({"position": 0.001, "effort": 0.2, "stalled": False})


def test_every_example_is_shown_and_tested():
    shown = (FOLDER.parent / "examples.md").read_text(encoding="utf-8")
    unit = FOLDER.parents[1] / "tests" / "unit"
    files = (Path(__file__), Path(__file__).with_name("test_tutorial.py"))
    tested = "".join(file.read_text() for file in (*files, unit / "test_export_check.py"))
    for path in FOLDER.glob("*.py"):
        assert f"<!-- example: docs/examples/{path.name} -->" in shown
        assert f'run("{path.stem}")' in tested or f"docs/examples/{path.name}" in tested


@pytest.mark.parametrize("page", examples.PAGES, ids=lambda page: page.name)
def test_pages_contain_the_present_code_of_their_examples(page):
    text = page.read_text(encoding="utf-8")
    assert examples.with_examples(text) == text, "`python -m tools.examples` copies the files"


def test_the_code_between_the_comments_is_replaced_and_nothing_else():
    comment = "<!-- example: docs/examples/spectrum.py -->\n"
    old = f"before\n{comment}old\n<!-- /example -->\n<!-- other -->\n"
    code = (FOLDER / "spectrum.py").read_text(encoding="utf-8")
    new = f"{comment}\n```python\n{code}```\n\n<!-- /example -->\n"
    assert examples.with_examples(old) == f"before\n{new}<!-- other -->\n"
    with pytest.raises(ValueError, match="has no comment <!-- /example -->"):
        examples.with_examples(f"{comment}text\n{comment}<!-- /example -->\n")
    with pytest.raises(FileNotFoundError):
        examples.with_examples(old.replace("spectrum.py", "no_file.py"))


def run_notebook(name: str, **settings: str) -> dict:
    """Run the code cells of a notebook without stored output, and return its names.

    `settings` replace the values of assignments, by name.
    """
    cells = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    programs = [cell for cell in cells if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] or cell["execution_count"] for cell in programs)
    names: dict[str, object] = {}
    code = "\n".join("".join(cell["source"]) for cell in programs)
    for setting, value in settings.items():
        line = f"{setting} = {value}"
        code, count = re.subn(rf"^{setting} = .*$", lambda _, line=line: line, code, flags=re.M)
        assert count == 1
    exec(code, names)
    return names


@pytest.fixture
def notebook_folder(tmp_path, monkeypatch) -> None:
    """A notebook draws without a window and writes into a folder of the test."""
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


@pytest.fixture
def players(monkeypatch) -> list:
    """The sounds of the players: a stand-in of IPython, which only the site needs, lists them."""
    sounds = []
    ipython = ModuleType("IPython")
    ipython.get_ipython = lambda: None  # for matplotlib
    display = ModuleType("IPython.display")
    display.Audio = lambda samples, rate: sounds.append((samples, rate))
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    return sounds


def test_notebook_of_the_sample(notebook_folder):
    names = run_notebook("explore_sample")
    assert len(names["y"]) == 256
    assert all(share > 2 / 16 for share in names["accuracy"].values())  # twice the chance level


def test_notebook_of_own_recordings(notebook_folder, players):
    names = run_notebook("own_recordings")
    table = names["table"]
    assert (len(table), table.grasp.nunique(), table.session.nunique()) == (144, 72, 3)
    for split, column in (("held-out grasps", "grasp"), ("held-out sessions", "session")):
        groups = table[column].to_numpy()
        for train, test in names["splits"][split][0]:
            assert not set(groups[train]) & set(groups[test])
    accuracy = names["scores"].set_index("test data")
    # The shift of a session (3 %) moves a mode to that of another label (4 to 8 %).
    assert accuracy.accuracy["held-out sessions"] < accuracy.low["held-out grasps"]
    assert accuracy.low["held-out sessions"] > 0.5 > accuracy.chance["held-out sessions"]
    worst, wrong = names["worst"], names["wrong"]
    assert worst.label != worst.predicted and worst.probability == wrong.probability.max()
    assert f"_{worst.label}_" in worst.path.name
    example = names["example"]
    assert example.label == worst.predicted
    assert [rate for _, rate in players] == [44_100, 44_100]
    for (samples, _), path in zip(players, (worst.path, example.path), strict=True):
        np.testing.assert_array_equal(samples, soundfile.read(path, dtype="float32")[0])


def test_notebook_of_own_recordings_with_simple_names(notebook_folder, players, tmp_path):
    """White and blue noise in one session: no split by session, and no wrong prediction."""
    folder = tmp_path / "recordings"
    folder.mkdir()
    random = np.random.default_rng(0)
    for number in range(12):
        noise = 0.1 * random.normal(size=4_410)
        label, samples = ("white", noise) if number < 6 else ("blue", np.diff(noise))
        soundfile.write(folder / f"{number + 1}_{label}.wav", samples, 44_100)
    names = run_notebook(
        "own_recordings",
        FOLDER=f"Path({str(folder)!r})",
        PATTERN='r"(?P<grasp>\\d+)_(?P<label>[^/]+)\\.wav"',
    )
    assert list(names["results"]) == ["random (optimistic)", "held-out grasps"]
    assert names["wrong"].empty and len(players) == 2
    assert names["worst"].probability == names["predicted"].probability.min()


def test_notebook_of_a_figure_of_a_paper(notebook_folder):
    names = run_notebook("paper_figure")
    grasps_db = names["level_db"].loc["padlock"].iloc[:, 0].to_numpy()
    assert len(grasps_db) == 8
    low, high = scipy.stats.bootstrap(
        [grasps_db], np.mean, n_resamples=2000, rng=np.random.default_rng(0)
    ).confidence_interval
    curve = names["curves"]["padlock"].iloc[0]
    assert curve.mean_db == pytest.approx(grasps_db.mean())
    # For 8 values, Student's t is wider than the bootstrap: about 2.36 / 1.96 * (8 / 7) ** 0.5.
    assert (high - low) / 2 < curve.half_width_db < 2 * (high - low) / 2
    pdf = (names["FOLDER"] / "figure_1.pdf").read_bytes()
    assert b"/FontFile2" in pdf and b"/Type3" not in pdf  # embedded TrueType
    width_pt = float(re.search(rb"/MediaBox \[ 0 0 ([\d.]+)", pdf)[1])
    assert width_pt == pytest.approx(88.9 / 25.4 * 72)
    svg = (names["FOLDER"] / "figure_1.svg").read_text(encoding="utf-8")
    assert "<text" not in svg  # letters are outlines


def test_each_notebook_is_listed_and_tested():
    shown = (FOLDER.parent / "examples.md").read_text(encoding="utf-8")
    tested = Path(__file__).read_text(encoding="utf-8")
    for path in FOLDER.glob("*.ipynb"):
        assert f"(examples/{path.name})" in shown
        assert f'run_notebook("{path.stem}")' in tested
