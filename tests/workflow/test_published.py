"""Data sets are published by the workflow, and the report leads to them."""

import shutil

import pytest
import yaml

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
