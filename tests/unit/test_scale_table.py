"""The tables of the benchmark of scale say what was measured, and where nothing was."""

import pytest

from benchmarks import scale_table


def row(stage: str, recordings: int, **took) -> dict:
    return {"stage": stage, "recordings": recordings, **took}


FOUND = [
    *(row("merge", n, cpu_s=0.5 + n * each, peak_mb=100.4, written_mb=2.0)
      for n, each in ((500, 1e-3), (5_000, 1e-3), (50_000, 3e-3))),
    row("publish", 500, cpu_s=1.0, peak_mb=80.0, written_mb=7.0),
    row("publish", 5_000, beyond_s=900.0),
    row("job: report", 500, cpu_s=4.25),
    row("fetch", 500, failed=1),
    row("report", 500, page_kb=32.1, explorer_kb=900.0, beside_mb=1.25),
    row("merge", 500, opened=1_234),
]  # fmt: skip
TOLD = {"found": FOUND, "take_s": 0.25, "cores": 2, "machine": "x86_64"}


@pytest.fixture
def rows() -> list[str]:
    return scale_table.as_markdown(TOLD).splitlines()


def test_each_stage_has_a_row_and_what_was_not_measured_a_dash(rows):
    assert "| stage | 500 | 5,000 | 50,000 |" in rows
    assert "| merge | 1.0 s; 100; 2 | 5.5 s; 100; 2 | 150.5 s; 100; 2 |" in rows
    assert "| publish | 1.0 s; 80; 7 | more than 900 s | – |" in rows
    assert "| job: report | 4.2 s; –; – | – | – |" in rows
    assert "| fetch | failed | – | – |" in rows
    assert "| report | 32; 900; 1.2 |" in rows
    assert "| merge | 1,234 |" in rows


def test_what_a_start_takes_is_told_apart_from_each_recording(rows):
    # 1 ms each up to 5,000 and half a second before; then 145 s for 45,000
    assert "| merge | 0.5 | 1.000 | 3.222 |" in rows
    assert not any(line.startswith("| publish | 0") for line in rows)  # of one size nothing


def test_only_what_stands_between_the_marks_is_replaced(tmp_path):
    page = tmp_path / "scale.md"
    page.write_text(f"before\n{scale_table.BEGIN}\nold\n{scale_table.END}\nafter\n")
    scale_table.into(page, "new")
    assert page.read_text() == f"before\n{scale_table.BEGIN}\n\nnew\n{scale_table.END}\nafter\n"
