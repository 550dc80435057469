"""`ajgdata new` and `ajgdata paper`: complete projects, and never a changed file."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import soundfile
import yaml

from ajgdata.paths import Paths
from ajgdata.store.files import read_yaml
from ajgdata.store.sessions import list_datasets, read_dataset

ROOT = Path(__file__).parents[2]
FILES = {
    "Snakefile",
    "README.md",
    ".gitignore",
    "config/config.yaml",
    "profiles/default/config.yaml",
    "profiles/slurm/config.yaml",
    "datasets/dataset.schema.json",
    "datasets/example.yaml",
}


def files_of(folder: Path) -> dict[str, bytes]:
    found = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}


@pytest.fixture
def lab(ajgdata, tmp_path, monkeypatch):
    """A new project, which is the working directory."""
    monkeypatch.chdir(tmp_path)
    assert ajgdata("new", "lab")[0] == 0
    monkeypatch.chdir(tmp_path / "lab")
    return Paths(tmp_path / "lab")


def test_a_new_project_has_the_files_of_the_package_and_no_data_set(lab):
    assert set(files_of(lab.root)) == FILES
    assert lab.data.is_dir()
    assert list_datasets(lab) == []
    assert lab.profile.read_bytes() == (ROOT / "profiles/default/config.yaml").read_bytes()


def test_outside_a_project_every_command_proposes_a_new_one(ajgdata, tmp_path, monkeypatch):
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    for command in (["import", "x", "--dataset", "mine"], ["check"], ["run", "mine"], ["paper"]):
        code, out, err = ajgdata(*command)
        assert (code, out) == (1, "")
        assert "Create one with `ajgdata new FOLDER`" in err
    assert files_of(tmp_path / "empty") == {}


def test_a_snakefile_of_another_workflow_is_named_and_nothing_is_written(ajgdata, tmp_path):
    file = tmp_path / "lab/Snakefile"
    file.parent.mkdir()
    file.write_text("my own")
    code, out, err = ajgdata("new", tmp_path / "lab")
    assert (code, out) == (1, "")
    assert err.count("\n") == 1
    assert "Snakefile: exists with other content. Name another folder" in err
    assert files_of(tmp_path / "lab") == {"Snakefile": b"my own"}


@pytest.mark.parametrize("name", sorted(FILES - {"Snakefile"}))
def test_own_and_interrupted_files_stay_and_missing_ones_are_added(ajgdata, lab, name):
    complete = files_of(lab.root)
    own = lab.root / name
    for file in FILES - {name, "Snakefile"}:
        (lab.root / file).unlink()
    own.write_bytes(b"my own")
    assert ajgdata("new", ".")[0] == 0
    assert files_of(lab.root) == complete | {name: b"my own"}
    assert ajgdata("new", ".")[1].startswith("nothing to add")


def test_other_files_of_the_folder_stay(ajgdata, tmp_path):
    folder = tmp_path / "sounds"
    folder.mkdir()
    (folder / "1_cube.wav").write_bytes(b"a sound")
    assert ajgdata("new", folder)[0] == 0
    assert set(files_of(folder)) == {*FILES, "1_cube.wav"}


def test_the_example_is_a_valid_data_set(lab):
    content = read_yaml(lab.example_dataset)
    lab.dataset("example").parent.mkdir()
    lab.dataset("example").write_text(yaml.safe_dump(content))
    spec = read_dataset(lab, "example")
    assert set(spec.tasks) == {"label", "edge"}
    commented = lab.example_dataset.read_text().partition("# protocol:")[2].partition("\n\n")[0]
    protocol = yaml.safe_load(commented.replace("\n# ", "\n"))
    lab.dataset("example").write_text(yaml.safe_dump(content | {"protocol": protocol}))
    assert read_dataset(lab, "example").protocol.grasps_per_object == 12


def test_the_paper_has_the_simulated_data_sets_and_variants_of_the_clone(ajgdata, lab):
    assert ajgdata("paper")[1].startswith("36 new data sets in ")
    copied = files_of(lab.root)
    names = [name for name in copied if name.startswith(("datasets/", "reports/"))]
    for name in set(names) - FILES:
        assert copied[name] == (ROOT / name).read_bytes()
    assert {"size", "ycb", "grippers"} < set(list_datasets(lab))
    public = {file.parent.name for file in (ROOT / "datasets").glob("*/source.yaml")}
    assert set(list_datasets(lab)) == set(list_datasets(Paths(ROOT))) - public
    variants = {f"reports/variants/{file.name}" for file in (ROOT / "reports/variants").iterdir()}
    assert variants < set(names)
    assert ajgdata("paper")[1].startswith("0 new data sets")
    assert files_of(lab.root) == copied


def test_an_own_data_set_of_the_same_name_is_not_replaced(ajgdata, lab):
    lab.dataset("size").parent.mkdir()
    lab.dataset("size").write_text("name: size")
    before = files_of(lab.root)
    code, _, err = ajgdata("paper")
    assert code == 1
    assert "size/dataset.yaml: exists with other content. Rename your file" in err
    assert files_of(lab.root) == before


def test_public_recordings_of_the_package_can_be_fetched_by_name(ajgdata, lab, monkeypatch):
    """The download is not tried: without an address, it ends with one line."""
    monkeypatch.setenv("PATH", "")  # no git
    code, out, err = ajgdata("fetch", "franka_contact")
    assert code == 1 and err.count("\n") == 1
    assert "licence: " in out
    folder = ROOT / "datasets/franka_contact"
    for name in ("dataset.yaml", "source.yaml"):
        assert (lab.datasets / "franka_contact" / name).read_bytes() == (folder / name).read_bytes()
    code, _, err = ajgdata("fetch", "absent")
    assert code == 1 and "franka_contact" in err


def test_a_project_runs_by_plain_snakemake(lab):
    """Its Snakefile uses the workflow as a module; the default target is that of the workflow."""
    command = [sys.executable, "-m", "snakemake", "--dry-run"]
    done = subprocess.run(command, cwd=lab.root, check=False, capture_output=True, text=True)
    assert done.returncode == 1
    problem = "no data set here has recordings or a recipe. Get some with `ajgdata import FOLDER"
    assert problem in done.stdout + done.stderr


def test_a_run_of_recordings_needs_no_simulation(ajgdata, lab, tmp_path, monkeypatch):
    """Without a recipe, no study of the virtual gripper is planned, so numba is not needed."""
    rng = np.random.default_rng(0)
    sounds = tmp_path / "sounds"
    sounds.mkdir()
    for number, label in enumerate(("cube", "ball") * 3, 1):
        samples = 0.1 * rng.standard_normal(4096)
        soundfile.write(sounds / f"{number}_{label}.wav", samples, 44_100)
    code, out, err = ajgdata("import", sounds, "--dataset", "mine")
    assert code == 0, out + err
    command = [sys.executable, "-m", "snakemake", "--dry-run"]
    done = subprocess.run(command, cwd=lab.root, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    planned = re.findall(r"^(\w+) +\d+$", done.stdout + done.stderr, re.M)
    assert {"features", "experiment", "train", "report"} <= set(planned)
    assert not {"study", "opening", "acquire"} & set(planned)
