"""A run stands in nobody's way after it was killed, whatever the next one is to make."""

import shutil

from conftest import ROOT, snakemake_here

from ajgdata.paths import Paths


def test_a_run_without_data_sets_removes_the_lock_of_a_dead_one_and_a_look_does_not(tmp_path):
    paths = Paths(tmp_path)
    shutil.copytree(ROOT / "datasets/plate", tmp_path / "datasets/plate")
    lock = paths.snakemake_locks / "0.output.lock"
    lock.parent.mkdir(parents=True)
    lock.write_text(f"{paths.verified_solver.relative_to(tmp_path)}\n")
    asked = ["--snakefile", str(ROOT / "Snakefile"), "--directory", str(tmp_path)]
    asked += ["--config", "datasets=[plate]", "pages=[]", "--cores", "1", "--quiet", "all"]
    asked += ["--touch", str(paths.verified_solver.relative_to(tmp_path))]
    assert snakemake_here(*asked, "--dry-run") == 0
    assert lock.exists() and not paths.cache.exists()
    assert snakemake_here(*asked) == 0
    assert not lock.exists()
