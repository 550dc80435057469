"""The check, the run and the report count recordings with issues, and cost, in the same words."""

from __future__ import annotations

import re

import numpy as np
import soundfile
from recorded import make_features
from sounds import RATE_HZ, resonances, write_wav

from ajgdata.pipeline.report import build_report
from ajgdata.pipeline.run_summary import complete


def finish_run(paths, name):
    """Write the report and the summary; return the text of the first page, and the summary."""
    build_report(paths, datasets=[name], tasks=[], requested=[])
    complete(paths, [name], [], [], [], [], paths.complete)
    page = re.sub(r"<[^>]+>", "", paths.report.read_text(encoding="utf-8"))
    return " ".join(page.split()), paths.complete.read_text(encoding="utf-8")


def write_benchmark(paths, name, seconds, memory):
    file = paths.benchmarks / f"{name}.tsv"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"s\tcpu_time\tmax_rss\tmax_pss\n{seconds}\t{seconds}\t{memory}\t{memory}\n")


def test_notes_are_notes_in_all_three_places(ajgdata, paths, src):
    for grasp in range(6):
        sound = resonances(grasp % 2, grasp)
        stereo = np.stack([sound, sound], axis=1)
        label = ("cube", "ball")[grasp % 2]
        soundfile.write(src / f"{grasp + 1}_{label}.wav", stereo, RATE_HZ, subtype="PCM_16")
    ajgdata("import", src, "--dataset", "mine")
    words = "0 errors, 0 warnings, 6 notes"
    assert f"6 recordings checked: {words}" in ajgdata("check", "mine").text
    make_features(paths, "mine")
    page, summary = finish_run(paths, "mine")
    assert f"recordings with issues: {words}" in summary
    assert f"recordings with issues: {words}" in page
    assert "with warnings" not in page


def test_each_recording_counts_once_by_its_worst_issue(ajgdata, paths, src):
    for grasp in range(4):
        for number, label in enumerate(("cube", "ball")):
            write_wav(src / f"{grasp + 1}_{label}.wav", resonances(number, grasp))
    write_wav(src / "1_cube.wav", np.zeros(11_025))
    clipped_with_offset = np.clip(3 * resonances(0, 1) + 0.5, -1, 1)
    write_wav(src / "2_cube.wav", clipped_with_offset)
    ajgdata("import", src, "--dataset", "mine")
    words = "1 error, 1 warning, 0 notes"
    printed = ajgdata("check", "mine")
    assert printed.code == 3
    assert f"8 recordings checked: {words}" in printed.text
    assert "clipped 1" in printed.text and "offset 1" in printed.text
    make_features(paths, "mine")
    page, summary = finish_run(paths, "mine")
    assert f"recordings with issues: {words}" in page
    assert f"recordings with issues: {words}" in summary


def test_cost_is_the_same_text_in_report_and_summary(ajgdata, paths, src):
    for grasp in range(4):
        write_wav(src / f"{grasp + 1}_cube.wav", resonances(0, grasp))
    ajgdata("import", src, "--dataset", "mine")
    make_features(paths, "mine")
    write_benchmark(paths, "features/mine", 90, 1000)
    write_benchmark(paths, "collect", 30, 3000)
    build_report(paths, datasets=["mine"], tasks=[], requested=[])
    write_benchmark(paths, "report", 600, 9000)  # known after the report is written
    complete(paths, ["mine"], [], [], [], [], paths.complete)
    page = " ".join(re.sub(r"<[^>]+>", "", paths.report.read_text(encoding="utf-8")).split())
    cost = "2 jobs, 2.0 min wall time, 2.0 min CPU time, peak memory 3,146 MB"
    assert f"Cost without final models: {cost}" in page
    assert f"cost without final models: {cost}\n" in paths.complete.read_text(encoding="utf-8")


def test_a_level_jump_is_reported_again_when_features_are_reused(ajgdata, paths, src, capsys):
    for grasp in range(5):
        for number, label in enumerate(("cube", "ball")):
            gain = 0.1 if grasp == 4 else 1
            write_wav(src / f"{grasp + 1}_{label}.wav", gain * resonances(number, grasp))
    ajgdata("import", src, "--dataset", "mine")
    make_features(paths, "mine")
    first = paths.quarantine("mine").read_text()
    assert first.count("level_jump") == 2
    make_features(paths, "mine")
    assert "0 recordings read, 10 features reused" in capsys.readouterr().out
    assert paths.quarantine("mine").read_text() == first
