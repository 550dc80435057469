"""The command that shows the log of a run."""

import json
import signal
import subprocess
import sys
import urllib.request

from live_events import run

COMMAND = [sys.executable, "-c", "from ajgdata.cli import main; main()", "dashboard"]


def test_the_command_shows_the_end_of_a_run_until_ctrl_c(tmp_path):
    log = tmp_path / "events.jsonl"
    log.write_text("".join(json.dumps(event) + "\n" for event in run()))
    with subprocess.Popen([*COMMAND, str(log)], stdout=subprocess.PIPE, text=True) as process:
        try:
            first = process.stdout.readline()
            address = first.rsplit(" ", 1)[1].split("#")[0]
            assert first.startswith(f"{len(run())} events: http://127.0.0.1:")
            process.stdout.readline()
            with urllib.request.urlopen(f"{address}state", timeout=120) as answer:
                state = json.load(answer)
            assert (state["n"], state["correctable"]) == (len(run()) - 1, False)
            assert state["plan"]["replay"] is True
            process.send_signal(signal.SIGINT)
            assert process.wait(120) == 0
        finally:
            process.kill()
