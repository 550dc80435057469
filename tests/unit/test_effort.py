"""What a run says that it took."""

import subprocess
import sys

from ajgdata.pipeline.effort import Effort, effort, effort_line
from ajgdata.pipeline.run_summary import Data

DATA = [Data("a", 1_000, 20), Data("b", 480, 0)]


def test_the_line_says_what_was_made_and_what_was_kept():
    took = Effort(3_725.4, 125.0, 1_234.5, 12, 90, 300)
    assert effort_line(took, DATA) == (
        "this run: 1 h 2 min; 2 min 5 s of processor time; 1,234 MB at most; "
        "12 jobs run, 90 current; 300 recordings read, 1,200 kept"
    )
    elsewhere = Effort(59.6, None, None, 1, 0, 0)
    assert effort_line(elsewhere, DATA) == (
        "this run: 1 min 0 s; 1 job run, 0 current; 0 recordings read, 1,500 kept"
    )


def test_after_failures_nothing_is_said_of_what_was_kept():
    took = Effort(5.0, None, None, 1, 2, 300, whole=False)
    assert effort_line(took, DATA) == "this run: 5 s; 1 job run, 2 current; 300 recordings read"


def test_ended_processes_count_with_their_time_and_memory(tmp_path):
    before = effort(1.0, 1, 0, [], local=True)
    code = "import time; x = bytearray(b'1') * 400_000_000\nwhile time.process_time() < 0.5: pass"
    subprocess.run([sys.executable, "-c", code], check=True)
    log = tmp_path / "features.log"
    log.write_text("something else\n7 recordings read, 5 features reused\n")
    after = effort(1.0, 1, 0, [log, tmp_path / "none.log"], local=True)
    assert after.cpu_s - before.cpu_s >= 0.5
    assert after.peak_mb >= 400
    assert after.read == 7
    assert effort(1.0, 1, 0, [log], local=False).cpu_s is None
