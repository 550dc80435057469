"""Embeddings in the workflow: asked for alone they take what they need, and the report has them."""

import re

import pytest
import yaml
from conftest import DECLARATION

EMBEDDING = {
    "instance": "pitch",
    "supervision": "Which tones are the same.",
    "target": "pitch",
    "dimensions": [2, 3],
    "shown": 3,
    "folds": 2,
    "inits": 1,
    "epochs": 1,
    "probes": {"pitch": {}},
}
MADE = {"embed": 1, "embed_knn": 1, "embed_measure": 1, "embed_projections": 1, "explorer": 1}
END = "results/report/index.html"


@pytest.fixture
def embedded(project):
    declaration = DECLARATION | {"embeddings": {"tones": EMBEDDING}}
    project.paths.dataset("tones").write_text(yaml.safe_dump(declaration))
    return project


def test_nothing_is_made_of_embeddings_that_are_not_declared(project):
    assert project.planned(END) == {}


def test_the_page_takes_the_embedding_alone_and_the_report_takes_the_page(embedded):
    assert embedded.planned("report_embedding") == {**MADE, "report_embedding": 1}
    assert embedded.planned(END) == {**MADE, "report_embedding": 1, "report": 1}


def test_all_results_are_collected_with_those_of_embeddings(embedded):
    measured = {name: 1 for name in MADE if name not in ("embed_projections", "explorer")}
    assert embedded.planned("results/metrics.json") == {**measured, "collect": 1}


def test_looking_at_a_latent_needs_no_measurement_of_it(embedded):
    explorer = str(embedded.paths.explorer("tones", "tones").relative_to(embedded.root))
    assert embedded.planned(explorer) == {"embed": 1, "embed_projections": 1, "explorer": 1}


@pytest.mark.slow
def test_the_page_is_made_and_linked_and_made_once(embedded):
    embedded.snakemake(END)
    assert embedded.planned(END) == {}
    report = embedded.paths.report.read_text(encoding="utf-8")
    assert '<a href="embedding.html">' in report
    page = embedded.paths.page("embedding").read_text(encoding="utf-8")
    files = re.findall(r'href="(embedding/[^"]+|latents/[^"]+)"', page)
    assert "latents/tones/tones.html" in files and len(files) > 10
    for link in files:
        assert (embedded.paths.report.parent / link).is_file()
