"""`make sort-live`: the sorting row through PortAudio, with the virtual gripper as a sound card.

The loop of `ajgdata sort` on the placements and in the orders of the experiment `live_sorting`:
each probability and decision is compared with that of the same grasp in this process. Needs its
results and the trained model (`make reproduce`), jackd2 and libportaudio2, and no hardware: the
card runs as fast as all can follow. Writes results/live/sorting.json.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ajgdata.acquire.card import Card, CardSettings
from ajgdata.acquire.excitation import excitation_samples
from ajgdata.acquire.line import open_card
from ajgdata.acquire.live_session import live_session
from ajgdata.acquire.plant import scene_response
from ajgdata.acquire.recipe import new_grasp
from ajgdata.acquire.robot import Placement
from ajgdata.acquire.simulated_card import DEVICE, SERVER_VARIABLE, load_jack, switch
from ajgdata.acquire.solving import SerialSolver
from ajgdata.acquire.virtual import chain_of, scene_of
from ajgdata.evaluate.sorting import orders
from ajgdata.live.decision import judge
from ajgdata.live.events import Event, EventLog, latencies, read_events
from ajgdata.live.kept import KeptRun
from ajgdata.live.prediction import Prediction
from ajgdata.live.predictor import Predictor
from ajgdata.live.sort import Outcome, Sorter
from ajgdata.loading import load_predictor
from ajgdata.paths import EXCITATION_FILE, Paths
from ajgdata.pipeline.rendering import new_grasps_of
from ajgdata.store.audio import read_audio
from ajgdata.store.provenance import layer_hash
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import read_tables, write_tables
from ajgdata.types import AudioSettings, DataError, DatasetSpec
from ajgdata.types.plan import SortPlan
from ajgdata.types.table import Table, table_of


class Placed(NamedTuple):
    """A placement of the experiment: an object, and its number among those of this object."""

    object: str
    number: int


@dataclass
class CardRobot:
    """Robot (see acquire.robot) that places objects under the simulated card, as if it moved."""

    paths: Paths
    spec: DatasetSpec
    coming: Sequence[Placed] = ()
    made: list[tuple[str, int, int]] = field(default_factory=list)  #: object, number, look

    def __post_init__(self) -> None:
        recipe = self.spec.recipe
        if recipe is None or recipe.source != "virtual":
            fix = "name one of the virtual gripper's"
            raise DataError(self.paths.dataset(self.spec.name), "has no scenes to place", fix)
        self._recipe, self._chain = recipe, chain_of("recipe: signal", recipe.signal)
        self._solver, self._code = (
            SerialSolver(self.paths.responses),
            layer_hash("gripper"),
        )

    def approach(self, placement: Placement) -> None:
        """Let the card play the next look at a placement."""
        placed = self.coming[placement.number - 1]
        looks = sum(one[:2] == placed for one in self.made)
        wanted = (*placed, looks + 1)
        self.made.append(wanted)
        title = " ".join(map(str, wanted))
        if not switch(title):
            scene = scene_of(
                title, new_grasp(self._recipe, self.spec.name, *wanted, self._code).setup
            )
            switch(title, scene_response(self._solver.solve(scene), self._chain))

    def loosen(self) -> None:
        """Nothing to do, as for each step but `approach`."""

    def hold(self, seconds: float) -> None:
        """Grains that are not there settle at once."""

    def jam(self) -> None:
        """Nothing."""

    def lift(self) -> None:
        """Nothing."""

    def release(self) -> None:
        """Nothing."""

    def place(self, bin: str) -> None:
        """Nothing: what is held has a bin by now."""

    def halt(self, held: str) -> None:
        """Nothing moves."""


@contextmanager
def simulated_card(folder: Path, noise: bool) -> Iterator[None]:
    """Run the simulated card on its own JACK server, with or without the microphone's noise."""
    load_jack()
    os.environ[SERVER_VARIABLE] = f"ajgdata-sort-{os.getpid()}"
    command = [sys.executable, "-c", "from ajgdata.cli import main; main()", "device", "simulate"]
    command += ["empty", "--noise" if noise else "--no-noise"]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True) as card:
        try:
            said = ""
            while "is there;" not in said:
                said = card.stdout.readline() if card.stdout else ""
                if not said:
                    sys.exit(1)  # it has said why
            yield
        finally:
            card.terminate()


@contextmanager
def freewheeling() -> Iterator[None]:
    """Let time run as fast as all can follow: for clients that are there already."""
    control = load_jack().Client("ajgdata-clock", no_start_server=True)
    control.set_freewheel(True)
    try:
        yield
    finally:
        control.set_freewheel(False)
        control.close()


class Lab(NamedTuple):
    """What all runs share."""

    spec: DatasetSpec
    predictor: Predictor
    plan: SortPlan
    card: Card
    robot: CardRobot


def sort_once(lab: Lab, coming: Sequence[Placed], folder: Path) -> tuple[Outcome, list[Event]]:
    """Sort placements until one is in doubt; return the outcome, and every event of the log."""
    lab.robot.coming, rate = coming, lab.predictor.sample_rate_hz
    lab.robot.made.clear()
    target = lab.spec.tasks[lab.plan.task].target
    log_file = folder / "events.jsonl"
    with (
        live_session(
            folder / "sort", setup={"sort": lab.plan.model_dump(mode="json")},
            excitation=excitation_samples(lab.spec.excitation, rate),
            played=lab.spec.excitation, sample_rate_hz=rate, about={"device": DEVICE},
        ) as session,
        EventLog(log_file) as log,
    ):  # fmt: skip
        audio = AudioSettings(sample_rate_hz=rate)
        played = read_audio(folder / "sort" / EXCITATION_FILE, audio).samples
        sorter = Sorter(
            plan=lab.plan, senses=lab.predictor, card=lab.card, played=played, robot=lab.robot,
            kept=KeptRun(session, lambda name: {target: name}), log=log,
        )  # fmt: skip
        outcome = sorter.run([one.object for one in coming])
    return outcome, read_events(log_file)


@dataclass
class Compared:
    """What came through the card beside the same grasps in this process."""

    looks: int = 0
    largest: float = 0.0
    decisions: int = 0
    other_decisions: int = 0

    def add(self, lab: Lab, events: Sequence[Event], here: Sequence[Prediction]) -> None:
        """Compare the looks of a run, in order: what was said of each, and what was decided."""
        said = [one for one in events if one["event"] == "prediction"]
        decided = [one for one in events if one["event"] == "decision"]
        looks: list[Prediction] = []
        for there, decision, mine in zip(said, decided, here, strict=True):
            looks = [mine] if there["look"] == 1 else [*looks, mine]
            far = (abs(there["probability"][c] - p) for c, p in mine.probability.items())
            self.largest = max(self.largest, *far)
            own = judge(looks, lab.plan)
            same = (decision["action"], decision["value"]) == (str(own.action), own.value)
            self.other_decisions += not same
        self.looks, self.decisions = self.looks + len(said), self.decisions + len(decided)


def stage_rows(events: Sequence[Event]) -> Iterator[dict[str, Any]]:
    """Yield what each stage from approach to decision took."""
    for stage, one in latencies(events).items():
        yield {"stage": stage, "median_ms": 1e3 * one.median_s, "p99_ms": 1e3 * one.p99_s,
               "count": one.count}  # fmt: skip


def plan_of(predictor: Predictor, threshold: float, looks: int) -> SortPlan:
    """Return the paper's plan: what is not sure enough after all looks ends a run."""
    return SortPlan.model_validate(
        {
            "dataset": predictor.dataset, "task": predictor.task, "model": predictor.model,
            "looks": looks, "threshold": threshold, "bins": {c: c for c in predictor.classes},
            "wait_s": 0, "references": None, "card": {"device": DEVICE},
        }
    )  # fmt: skip


def run_all(
    lab: Lab, ways: Sequence[Sequence[Placed]], folder: Path
) -> tuple[list[dict[str, Any]], list[Event], Compared]:
    """Sort in each order; return a row a run, all events, and how they compare."""
    rows, every, compared = [], [], Compared()
    render = new_grasps_of(lab.robot.paths, lab.spec.name)
    rate = lab.predictor.sample_rate_hz
    for number, coming in enumerate(ways):
        begin = time.monotonic()
        outcome, events = sort_once(lab, coming, folder / f"{lab.plan.looks}-{number:02d}")
        heard = (samples.astype(np.float32) for samples in render(list(lab.robot.made)))
        compared.add(lab, events, [lab.predictor.predict(one, rate) for one in heard])
        rows.append(
            {"looks": lab.plan.looks, "run": number, "sorts": outcome.sorts,
             "mistakes": outcome.mistakes, "finished": outcome.finished, "reason": outcome.reason,
             "seconds": time.monotonic() - begin}
        )  # fmt: skip
        every += events
        print(f"run {number + 1}: {outcome.sorts} sorted, {outcome.reason}", flush=True)
    return rows, every, compared


def tables_of(rows: list[dict[str, Any]], stages: list[dict[str, Any]]) -> list[Table]:
    """Return runs, and the times of stages, as tables."""
    heads = {"looks": "Looks", "run": "Run", "sorts": "Sorts in a row", "mistakes": "Mistakes"}
    heads |= {"finished": "All sorted", "reason": "Ended by", "seconds": "Time, s"}
    times = {"stage": "Stage", "median_ms": "Median, ms", "p99_ms": "99 %, ms", "count": "Times"}
    return [
        table_of("runs", "Runs through the simulated sound card", rows, **heads),
        table_of("stages", "From approach to decision", stages, **times),
    ]


def options() -> argparse.Namespace:
    """Return what the command line says."""
    told = argparse.ArgumentParser(description=__doc__)
    told.add_argument("--project", type=Path, default=Path(), help="folder of datasets, results")
    told.add_argument("--dataset", default="ycb")
    told.add_argument("--task", default="sorting")
    told.add_argument("--model", default="cnn")
    told.add_argument("--runs", type=int, help="default: those of the experiment")
    told.add_argument("--placements", type=int, help="in a run; default: all of them")
    told.add_argument("--looks", type=int, nargs="+", default=[1], help="at an object, at most")
    told.add_argument(
        "--noise", action=argparse.BooleanOptionalAction, default=True,
        help="add the microphone's noise, which differs from the noise of the experiment",
    )  # fmt: skip
    return told.parse_args()


def main() -> None:
    """Sort, compare, and write what was found."""
    given = options()
    paths = Paths(given.project)
    experiment = paths.experiment(given.dataset, given.task, f"live_sorting-{given.model}")
    if not experiment.is_file():
        raise DataError(experiment, "is not there", "make reproduce, or: snakemake report_sorting")
    about, _ = read_tables(experiment)
    if "skipped" in about:
        raise DataError(experiment, f"was skipped: {about['skipped']}", "change the data set")
    settings = about["settings"]
    predictor = load_predictor(given.dataset, given.task, given.model, given.project)
    spec = read_dataset(paths, given.dataset)
    numbers = range(1, settings["placements"] + 1)
    pool = [Placed(name, number) for name in predictor.classes for number in numbers]
    every = orders(len(pool), given.runs or settings["runs"], about["seed"])
    ways = [[pool[row] for row in order[: given.placements]] for order in every]
    rate, robot = predictor.sample_rate_hz, CardRobot(paths, spec)
    card = CardSettings(device=DEVICE, loopback_channel=2, sample_rate_hz=rate)
    rows, stages, told = [], list[dict[str, Any]](), {}
    with (
        tempfile.TemporaryDirectory() as scratch,
        simulated_card(given.project, given.noise),
        open_card(card) as opened,
        freewheeling(),
    ):
        for looks in given.looks:
            plan = plan_of(predictor, settings["threshold"], looks)
            lab = Lab(spec, predictor, plan, opened, robot)
            made, events, compared = run_all(lab, ways, Path(scratch))
            rows += made
            told[str(looks)] = vars(compared)
            stages = stages or list(stage_rows(events))
    write_tables(
        paths.sort_live, tables_of(rows, stages), dataset=given.dataset, task=given.task,
        model=given.model, seed=about["seed"], compared=told, placements=len(ways[0]),
        git_commit=about["provenance"]["git_commit"], quick=about["provenance"].get("quick", False),
    )  # fmt: skip


if __name__ == "__main__":
    try:
        main()
    except DataError as error:
        sys.exit(str(error))
