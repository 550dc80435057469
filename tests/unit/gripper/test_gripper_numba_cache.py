"""Machine code is made once and kept between processes, and never outlives its sources."""

import ast
import shutil

from ajgdata.gripper import numba_cache
from ajgdata.gripper.numba_cache import FOLDER, njit, sources_digest

SIMULATE = """
from ajgdata import gripper
numerics = {"dx_mm": 6, "max_time_s": 0.004}
scene = {"object": {"kind": "cube", "edge_mm": 20}, "numerics": numerics}
gripper.simulate(gripper.Scene.model_validate(scene))
"""
#: How often each kernel was compiled, and how often loaded, by a process that simulates.
COUNT = f"""
{SIMULATE}
from ajgdata.gripper import solver
kernels = [one for one in vars(solver).values() if hasattr(one, "stats")]
print(sum(sum(k.stats.cache_misses.values()) for k in kernels),
      sum(sum(k.stats.cache_hits.values()) for k in kernels))
"""


def test_the_digest_sees_every_source(tmp_path):
    copy = shutil.copytree(FOLDER, tmp_path / "gripper", ignore=shutil.ignore_patterns("__py*"))
    assert sources_digest(copy) == sources_digest(FOLDER)
    seen = {sources_digest(copy)}
    for file in sorted(copy.glob("*.py")):
        file.write_bytes(file.read_bytes().replace(b"\n", b"\n\n", 1))
        seen.add(sources_digest(copy))
    assert len(seen) == 1 + len(list(copy.glob("*.py")))


CALLER = "from called import called\n\n\ndef caller(x):\n    return called(x) + 1\n"
CALLED = "from ajgdata.gripper.numba_cache import njit\n\n\n@njit(cache=True)\ndef called(x):\n"
RUN = """
import sys
from pathlib import Path
from ajgdata.gripper import numba_cache
numba_cache.FOLDER = Path(sys.path[0])
for factor in (2, 2, 3):
    (numba_cache.FOLDER / "called.py").write_text(f"{CALLED}    return x * {factor}\\n")
    for name in ("called", "caller"):
        sys.modules.pop(name, None)
    from caller import caller
    compiled = numba_cache.njit(cache=True)(caller)
    print(compiled(1), sum(compiled.stats.cache_hits.values()))
"""


def test_a_change_in_another_file_is_compiled(tmp_path, run_python):
    """Also that this test could fail: numba's own njit would print 3 again."""
    (tmp_path / "caller.py").write_text(CALLER)
    begin = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); sys.dont_write_bytecode = True\n"
    printed = run_python(f"{begin}CALLED = {CALLED!r}\n{RUN}").splitlines()
    assert printed == ["3 0", "3 1", "4 0"]


def test_a_second_process_compiles_nothing(run_python):
    exec(SIMULATE)
    misses, hits = map(int, run_python(COUNT).split())
    assert misses == 0 < hits


def test_numba_keeps_its_own_folder_for_others():
    before = numba_cache.config.CACHE_DIR
    njit(cache=True)(abs_of)
    assert before == numba_cache.config.CACHE_DIR


def abs_of(x):
    return abs(x)


def test_every_kernel_is_compiled_so():
    for file in FOLDER.glob("*.py"):
        if file.stem == "numba_cache":
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module == "numba":
                names = {alias.name for alias in node.names}
                assert not names & {"njit", "jit", "vectorize", "guvectorize"}, file.name
            assert not (isinstance(node, ast.Import) and node.names[0].name == "numba"), file.name
