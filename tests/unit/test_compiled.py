"""Functions of others that numba compiles are compiled once, not in each process."""

import subprocess
import sys

MODULE = """
import numba

@numba.njit
def twice(x):
    return 2 * x

def plain(x):
    return x
"""
PROGRAM = """
import functions
from ajgdata.embed.compiled import keep_compiled

keep_compiled([functions])
keep_compiled([functions])
assert functions.twice(21) == 42 and functions.plain(1) == 1
stats = functions.twice.stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
"""


def test_a_second_process_compiles_nothing(tmp_path):
    (tmp_path / "functions.py").write_text(MODULE)
    found = [
        subprocess.run(
            [sys.executable, "-c", PROGRAM],
            check=True,
            cwd=tmp_path,
            capture_output=True,
            text=True,
        ).stdout.split()
        for _ in range(2)
    ]
    assert found == [["0", "1"], ["1", "0"]]
    (tmp_path / "functions.py").write_text(MODULE.replace("2 * x", "x + x"))
    again = subprocess.run(
        [sys.executable, "-c", PROGRAM], check=True, cwd=tmp_path, capture_output=True, text=True
    )
    assert again.stdout.split() == ["0", "1"]  # another function
