"""Data sets are published by the workflow, and the report leads to them."""

import shutil
import subprocess
import sys

import pytest
import yaml
from conftest import edit_table

from ajgdata.paths import Tree
from ajgdata.store.publishing.archive import checksums_bytes


@pytest.mark.slow
def test_every_data_set_is_published_and_linked(project):
    settings = project.root / "settings.yaml"
    given = yaml.safe_load(settings.read_text())
    settings.write_text(yaml.safe_dump(given | {"publish": None}))
    planned = project.planned("everything")
    assert (planned["publish_dataset"], planned["report_everything"]) == (1, 1)
    project.snakemake("everything")
    tree = Tree(project.paths.published("tones"))
    assert (tree / tree.SUMS).read_bytes() == checksums_bytes(tree.root)
    features = project.paths.features("tones").read_bytes()
    assert (tree / tree.FEATURES).read_bytes() == features
    listed = project.paths.report.with_name("datasets.html")
    assert 'href="../published/tones/README.md"' in listed.read_text()
    assert project.planned("everything", "publish") == {}
    shutil.rmtree(tree.root)
    assert project.planned("publish") == {"publish_dataset": 1, "publish": 1}


def relabel(rows):
    rows[0]["pitch"] = "high" if rows[0]["pitch"] == "low" else "low"


@pytest.mark.slow
def test_a_refused_publishing_leaves_the_folder_and_its_checksums(project):
    settings = project.root / "settings.yaml"
    settings.write_text(yaml.safe_dump(yaml.safe_load(settings.read_text()) | {"publish": None}))
    project.snakemake("publish")
    tree = Tree(project.paths.published("tones"))
    before = {path: path.read_bytes() for path in tree.root.rglob("*") if path.is_file()}
    edit_table(project, "day1", relabel)
    command = [sys.executable, "-m", "snakemake", *project.arguments("publish")]
    stopped = subprocess.run(command, check=False, capture_output=True, text=True)
    assert stopped.returncode == 1
    assert "version 1.0.0 is published with other content: 1 label of pitch" in stopped.stderr
    assert {path: path.read_bytes() for path in tree.root.rglob("*") if path.is_file()} == before
    config = project.paths.dataset("tones")
    config.write_text(f"{config.read_text()}version: 1.1.0\n")
    project.snakemake("publish")
    assert (tree / tree.SUMS).read_bytes() == checksums_bytes(tree.root)
    assert project.planned("publish") == {}
