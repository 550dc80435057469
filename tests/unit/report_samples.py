"""A small report: a simulated regression and a recorded classification with hostile names."""

import numpy as np
from matplotlib.figure import Figure

from ajgdata.report.comparison import PaperFigure
from ajgdata.report.format import Caption
from ajgdata.report.report_data import (
    DatasetSummary,
    ExperimentPage,
    Illustration,
    Report,
    ReportPart,
    ResultRow,
    Spectra,
    TaskSection,
)
from ajgdata.types import FeatureSettings, Finding

SCRIPT = "<script>alert(1)</script>"
PAPER = PaperFigure(
    id="size",
    metric="rmse",
    value=2.6,
    unit="mm",
    text="RMSE 2.6 mm overall",
    where="cubes",
    source="arXiv 2603.00351",
)


def illustration(name: str) -> Illustration:
    text = f"Predicted against true, {name}."
    return Illustration(name, Caption(text, f"{text} A figure of {SCRIPT}."), Figure)


def row(label: str, value: str, **changes) -> ResultRow:
    return ResultRow(label, "RMSE", value, "8.2 mm", "3.2", "0.21", **changes)


def part(rows: tuple[ResultRow, ...], **changes) -> ReportPart:
    values = {
        "experiment": "cross_validation",
        "page": "size",
        "title": "Cross-validation",
        "summary": "Regression of edge_mm.",
        "text": f"# What\n\n## Question\n\nIs {SCRIPT} *escaped*?",
        "rows": rows,
        "figures": (illustration("size--cnn"), illustration("size--run-time")),
    }
    return ReportPart(**{**values, **changes})


def sections() -> tuple[TaskSection, ...]:
    sizes = (
        row("CNN", "2.20 ± 0.30 mm", best=True, paper=PAPER, answer="2.2 (1.75 to 2.65) mm"),
        row("k-NN", "4.00 ± 0.40 mm", paper=PAPER),
        row("CNN", "3.50 ± 0.40 mm", part="values withheld from training"),
    )
    kinds = (ResultRow("CNN", "accuracy", "70.0 ± 5.0 %", "60 %", "3", "0.2", best=True),)
    return (
        TaskSection("size", "edge", "Cube size · edge", "simulated", (part(sizes),)),
        TaskSection(
            "stones",
            "kind",
            f"{SCRIPT} · kind",
            "recorded",
            (part(kinds, figures=(), text="", summary="", page="stones"),),
        ),
    )


def dataset(name: str, source: str, **changes) -> DatasetSummary:
    frequency_hz = np.arange(33) * 44_100 / 64
    mean = np.stack([np.exp(-frequency_hz / 9_000), np.exp(-frequency_hz / 7_000)])
    values = {
        "name": name,
        "title": f"Data set {name}",
        "source": source,
        "description": "One-second sweeps.",
        "n_recordings": 1200,
        "n_sessions": 1,
        "sample_rate_hz": 44_100,
        "licence": "CC-BY-4.0",
        "citation": "The authors, 2026.",
        "features": FeatureSettings(band_hz=(100.0, 18_000.0)),
        "provenance": {
            "version": "0.1.0",
            "commit": "abc1234",
            "config_hash": "c0ffee",
            "inputs_hash": "f00d",
        },
        "spectra": Spectra(frequency_hz, ("basalt", "<b>granite</b>"), mean, "kind"),
    }
    return DatasetSummary(**{**values, **changes})


def sample_report() -> Report:
    problem = Finding("s1", "r7", f"audio/{SCRIPT}.wav", "error", "truncated", SCRIPT, "repeat it")
    flagged = Finding("s1", "r8", "audio/r8.wav", "warning", "clipped", "clips", "lower the gain")
    datasets = (
        dataset("size", "simulated", title="Cube size"),
        dataset("stones", "recorded", title=SCRIPT, findings=(problem, flagged)),
    )
    pages = (
        ExperimentPage(
            "size", "How large?", "How large is it?", "snakemake report_size", "Paper's"
        ),
        ExperimentPage("stones", SCRIPT, f"Is {SCRIPT} told?", "snakemake report_stones", "Beyond"),
    )
    return Report("Results", "0.1.0", "abc1234", datasets, sections(), pages=pages)
