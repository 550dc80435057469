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
}
#: k-NN, distances and projections.
MEASURED = {"embed": 1, "experiment": 3}
END = "results/report/index.html"


@pytest.fixture
def embedded(project):
    declaration = DECLARATION | {"embeddings": {"tones": EMBEDDING}}
    project.paths.dataset("tones").write_text(yaml.safe_dump(declaration))
    return project


def test_nothing_is_made_of_embeddings_that_are_not_declared(project):
    assert project.planned(END) == {}


def test_a_report_on_embeddings_alone_takes_no_more_than_it_needs(embedded):
    alone = {"report_alone": 1, "report_embedding": 1}
    assert embedded.planned("report_embedding") == {**MEASURED, **alone}
    assert embedded.planned(END) == {**MEASURED, "explorer": 1, "report": 1}


def test_all_results_are_collected_with_those_of_embeddings(embedded):
    assert embedded.planned("results/metrics.json") == {**MEASURED, "collect": 1}


def test_looking_at_a_latent_needs_no_measurement_of_it(embedded):
    explorer = str(embedded.paths.explorer("tones", "tones").relative_to(embedded.root))
    assert embedded.planned(explorer) == {"embed": 1, "experiment": 1, "explorer": 1}


@pytest.mark.slow
def test_embeddings_are_in_the_report_and_made_once(embedded):
    embedded.snakemake(END, "results/metrics.csv")
    assert embedded.planned(END) == {}
    folder = embedded.paths.report.parent
    pages = sorted((folder / "experiments").glob("embedding_*.html"))
    report = "".join(page.read_text(encoding="utf-8") for page in pages)
    assert report.count('id="task-tones-tones"') == len(pages) == 3
    assert "Nothing of this was evaluated" not in report
    assert 'href="../latents/tones/tones.html"' in report
    files = set(re.findall(r'href="\.\./(figures/embedding-[^"]+)"', report))
    assert len(files) > 10
    for link in (*files, "latents/tones/tones.html"):
        assert (folder / link).is_file()
    table = embedded.paths.metrics_table.read_text(encoding="utf-8")
    for part in ("tones,embedding:tones,latent,recorded,knn:3,", "cost of training,cpu_s,measured"):
        assert part in table
