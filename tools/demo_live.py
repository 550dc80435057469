"""`make demo-live`: a session of four objects through PortAudio, with a simulated sound card.

Needs two Debian packages, jackd2 and libportaudio2, and no hardware. Everything is written to
results/demo-live, or to the folder that is given.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDER = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "results/demo-live")
DATASET = "live_session"
DEVICE = "virtual gripper"
CHANNELS = ("--loopback-channel", "2")
#: The command of this environment, also for the robot.
ENVIRONMENT = os.environ | {
    "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
    "JACK_DEFAULT_SERVER": "ajgdata-demo",
}


def ajgdata(*arguments: str) -> None:
    """Run the command, as a person would type it."""
    print("\n$ ajgdata " + " ".join(f'"{one}"' if " " in one else one for one in arguments))
    sys.stdout.flush()
    subprocess.run(["ajgdata", *arguments], cwd=FOLDER, env=ENVIRONMENT, check=True)


@contextmanager
def simulated_card(*scenes: str) -> Iterator[None]:
    """Wait until the card is there; end it, and its server, at the end."""
    command = ["ajgdata", "device", "simulate", *scenes, "--grasps", "2"]
    print("$", *command, "&")
    with subprocess.Popen(
        command, cwd=FOLDER, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True
    ) as card:
        try:
            said = ""
            while "is there;" not in said:
                said = card.stdout.readline() if card.stdout else ""
                if not said:
                    sys.exit(1)  # it has said why
                print(said, end="")
            yield
        finally:
            card.terminate()


def main() -> None:
    """Record, check and validate the session."""
    begin = time.monotonic()
    declared = FOLDER / "datasets" / DATASET / "dataset.yaml"
    shutil.rmtree(FOLDER / "data", ignore_errors=True)
    declared.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(ROOT / "docs/examples/live_session.yaml", declared)
    with simulated_card("empty", *(f"cube_{edge}" for edge in ("10p0", "15p3", "20p7", "24p7"))):
        ajgdata("device", "check", DEVICE, *CHANNELS, "--drift", "5")
        source = ("--source", "soundcard", "--device", DEVICE, *CHANNELS)
        ajgdata("acquire", DATASET, *source, "--yes")
    ajgdata("validate", DATASET)
    print(f"\n{time.monotonic() - begin:.0f} s")


if __name__ == "__main__":
    try:
        main()
    except subprocess.CalledProcessError as error:
        sys.exit(error.returncode)
