"""Figures in README and docs are those of the results that they name. Rule `verify` runs this."""

from pathlib import Path

import pytest

from ajgdata.paths import Paths
from tools.findings.blocks import block, drifted
from tools.findings.documents import blocks_of, documents
from tools.findings.results import Results

pytestmark = pytest.mark.artefact

PAGES = documents(Path(__file__).resolve().parents[2])


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_no_figure_was_typed_over(page):
    assert drifted(page.read_text(encoding="utf-8"), Paths().results) == []


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_block_can_be_made_of_these_results(page):
    for name in blocks_of(page.read_text(encoding="utf-8")):
        reading = Results(Paths().results)
        try:
            text = block(name, reading)
        except FileNotFoundError:  # pages that were not asked for
            continue
        assert text.count("\n|") > 2, name
        assert reading.name() in text
