"""Publishing: the same bytes twice, everything said, and each defect found by its name."""

import hashlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from published import flip, make_project, published

from ajgdata.pipeline.publish import declaration_bytes
from ajgdata.store.files import read_csv, read_json
from ajgdata.store.provenance import commit_date
from ajgdata.types import DataError, DatasetSpec


@pytest.fixture
def project(tmp_path):
    return make_project(tmp_path / "project")


def contents(root: Path) -> dict[str, bytes]:
    return {str(p.relative_to(root)): p.read_bytes() for p in root.rglob("*") if p.is_file()}


def test_the_same_inputs_give_the_same_bytes(world, tmp_path):
    project, tree, _ = world
    published(project, tmp_path / "again")
    assert contents(tmp_path / "again") == contents(tree.root)


def test_recordings_are_the_originals_byte_for_byte(world):
    project, tree, _ = world
    _, rows = read_csv(tree / tree.METADATA)
    assert len(rows) == 12
    for row in rows:
        content = (tree / row["file_name"]).read_bytes()
        assert hashlib.sha256(content).hexdigest() == row["sha256"]
        if row["recording"][-1].isdigit():
            audio = project.folder(row["session_id"]) / f"audio/{row['recording'][-1]}.wav"
            assert content == audio.read_bytes()


def test_both_descriptions_say_what_was_declared(world):
    tree = world[1]
    croissant = read_json(tree / tree.CROISSANT)
    package = read_json(tree / tree.DATAPACKAGE)
    assert croissant["creator"] == {"@type": "sc:Person", "name": "A. Nobody"}
    assert croissant["datePublished"] == commit_date()
    assert croissant["license"] == package["licenses"][0]["path"]
    described = {item["name"]: item["description"] for item in croissant["recordSet"][0]["field"]}
    assert described["edge_mm"] == "length of the edge (mm)"
    fields = {item["name"]: item for item in package["resources"][0]["schema"]["fields"]}
    assert {name: item["unit"] for name, item in fields.items() if "unit" in item} == {
        "edge_mm": "mm"
    }
    assert fields["recording"]["constraints"] == {"required": True, "unique": True}
    for item in (*croissant["distribution"][:3], *package["resources"]):
        path = tree / item.get("contentUrl", item.get("path"))
        size = path.stat().st_size
        assert item.get("contentSize", f"{item.get('bytes')} B") == f"{size} B"


def test_the_card_says_what_was_left_out_and_is_no_html(world):
    _, tree, done = world
    card = (tree / tree.README).read_text()
    assert (done.left_out, done.recordings) == (2, 12)
    assert "2 recordings were left out" in card
    assert re.search(r"s1/take 0/6: .*cut short", card)
    body = card.split("---\n", 2)[2]
    assert "<b>" not in body
    assert "latex &lt;1&gt;" in body


def test_a_doi_is_in_every_citation_and_changes_no_version(project, tmp_path):
    out = tmp_path / "out"
    published(project, out)
    citation = yaml.safe_load((out / "CITATION.cff").read_text())
    assert (citation["cff-version"], citation["type"]) == ("1.2.0", "dataset")
    assert citation["authors"] == [{"name": "A. Nobody"}]
    assert (citation["license"], citation["version"]) == ("CC0-1.0", "1.0.0")
    assert "doi" not in citation
    declared = yaml.safe_load(project.paths.dataset("d").read_text())
    project.declare(**declared, doi="10.5281/zenodo.42")
    published(project, out)  # the same version
    address = "https://doi.org/10.5281/zenodo.42"
    assert read_json(out / "croissant.json")["citeAs"].endswith(f". Data set. {address}")
    assert read_json(out / "croissant.json")["url"] == address
    assert read_json(out / "datapackage.json")["id"] == address
    assert yaml.safe_load((out / "CITATION.cff").read_text())["doi"] == "10.5281/zenodo.42"
    card = (out / "README.md").read_text()
    assert f"DOI: <{address}>" in card
    assert card.rstrip().endswith(address)
    assert yaml.safe_load((out / "dataset.yaml").read_text())["doi"] == "10.5281/zenodo.42"
    project.declare(**declared, doi="10.5281/zenodo.43")
    with pytest.raises(DataError, match=r"with other content: doi in dataset.yaml"):
        published(project, out)


def test_a_doi_is_not_an_address():
    with pytest.raises(ValueError, match="doi"):
        DatasetSpec.model_validate({"name": "d", "doi": "https://doi.org/10.5281/zenodo.42"})


def test_settings_of_a_robot_stay_at_home():
    arm = {"command": ["arm", "--token", "secret"]}
    protocol = {"objects": [{"name": "cube"}], "robot": arm}
    spec = DatasetSpec.model_validate({"name": "d", "protocol": protocol})
    published = yaml.safe_load(declaration_bytes(spec))
    assert published["protocol"] == {"objects": [{"name": "cube"}]}


def test_a_changed_recording_is_not_published_and_the_old_tree_stays(project, tmp_path):
    out = tmp_path / "out"
    published(project, out)
    before = contents(out)
    flip(project.folder("s1") / "audio/0.wav")
    with pytest.raises(DataError, match="bytes changed since its features were computed"):
        published(project, out)
    assert contents(out) == before
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == [".out.lock"]


def test_the_examples_of_the_card_run(tree):
    """Without network, in a new process: these libraries read their settings at import."""
    code = re.findall(r"^```python\n(.*?)^```$", (tree / tree.README).read_text(), re.S | re.M)
    valid = 'import frictionless; assert frictionless.validate("datapackage.json").valid'
    caches = {"HF_HOME": f"{tree.root}/.hf", "CROISSANT_CACHE": f"{tree.root}/.croissant"}
    offline = {"HF_HUB_OFFLINE": "1", "HF_DATASETS_OFFLINE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", "\n".join([*code, valid])],
        cwd=tree.root,
        env={**os.environ, **offline, **caches},
        check=False,
        capture_output=True,
        text=True,
    )
    assert len(code) == 5 and done.returncode == 0, done.stderr
