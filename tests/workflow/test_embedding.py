"""Embeddings in the workflow: the report and the table of results have them."""

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
END = "results/report/index.html"


@pytest.fixture
def embedded(project):
    declaration = DECLARATION | {"embeddings": {"tones": EMBEDDING}}
    project.paths.dataset("tones").write_text(yaml.safe_dump(declaration))
    return project


def test_embeddings_are_in_the_report_and_made_once(embedded):
    assert embedded.planned(END) == {"embed": 1, "experiment": 3, "explorer": 1, "report": 1}
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
