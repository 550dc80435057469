"""Readers find the names of models and pages of the report in the documentation."""

from pathlib import Path
from typing import get_args

from ajgdata.report.navigation import FIXED, LEADS, PAPER_PAGE
from ajgdata.types import MODELS, Kind

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_page_on_models_has_the_name_of_each_model():
    page = (DOCS / "models.md").read_text(encoding="utf-8")
    labels = {model.label(kind) for model in MODELS.values() for kind in get_args(Kind)}
    names = {label.partition(",")[0] for label in labels}  # without ", plain"
    assert [name for name in sorted(names) if name not in page] == []


def test_the_page_on_the_report_has_the_title_of_each_page():
    page = (DOCS / "reading-the-report.md").read_text(encoding="utf-8")
    titles = {lead.title for lead in LEADS.values()}
    titles |= {link.title for link in (PAPER_PAGE, *FIXED.values())}
    assert [title for title in sorted(titles) if title not in page] == []
