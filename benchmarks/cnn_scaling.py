"""How the CNN's input is scaled: per bin, by one number, or both, on inner folds of several sets.

    python benchmarks/cnn_scaling.py RESULTS/features RECORDINGS

The first folder holds the simulated stores `size.nc` and `ycb.nc`, the second the recordings that
docs/real-recordings.md describes; what is absent is left out. Of each set only the training part of
the first outer fold is looked at, divided again as in `cnn_choice.py`.

The rule, declared before anything was measured: the winner of each set is that of `cnn_choice.py`.
If the sets do not agree, the lowest mean rank over all of them wins, equal errors sharing a rank,
and of equal mean ranks what the CNN had before.
"""

import tempfile
from functools import partial
from pathlib import Path
from typing import Annotated, get_args

import numpy as np
import typer
from cnn_choice import inner_rows, told, tried, winner
from recordings import FOLDERS, features_of
from scipy.stats import rankdata
from threadpoolctl import threadpool_limits

from ajgdata.evaluate.task_data import TaskData
from ajgdata.models.cnn import CnnClassifier, Scaling
from ajgdata.paths import Paths
from ajgdata.store.features import read_store

#: Which classes are told apart, and what is not divided. Folds of esc10 are two: one is trained on.
SIMULATED = {"ycb": "object", "size": "object"}
RECORDED = {
    "active_rp": ("label", "grasp_id"),
    "knock_material": ("material", "grasp_id"),
    "esc10": ("label", "grasp_id"),
    "stone_impact": ("form", "sample_name"),
}
SCALINGS: tuple[Scaling, ...] = get_args(Scaling)  # the first is what it was


def sets_of(features: Path, recordings: Path, project: Paths) -> dict[str, TaskData]:
    """The training part of each data set that is there."""
    found = {}
    for name, target in SIMULATED.items():
        if (features / f"{name}.nc").exists():
            found[name] = inner_rows(read_store(features / f"{name}.nc"), target)
    for name, (target, groups) in RECORDED.items():
        if (folder := recordings / FOLDERS[name]).is_dir():
            found[name] = inner_rows(features_of(project, name, folder), target, groups)
    return found


def main(
    features: Annotated[Path, typer.Argument(help="folder of simulated feature stores")],
    recordings: Annotated[Path, typer.Argument(help="folder of the recorded sets' folders")],
) -> None:
    """Print error and training time of each scaling on each set, and what is chosen."""
    winners, ranks = set(), []
    print("| data set | scaling | error, % | difference, % | training, s |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as temporary, threadpool_limits(limits=1):
        for name, rows in sets_of(features, recordings, Paths(Path(temporary))).items():
            made = [tried(rows, partial(_made, scaling), scaling) for scaling in SCALINGS]
            best = winner(made, rows.group)
            winners.add(best.value)
            ranks.append(rankdata([round(one.wrong.mean(), 9) for one in made]))
            for one in made:
                print(told(name, one, best, rows.group), flush=True)
    mean = np.mean(ranks, axis=0)
    print("\nmean rank: " + ", ".join(f"{s} {r:.2f}" for s, r in zip(SCALINGS, mean, strict=True)))
    agreed = winners.pop() if len(winners) == 1 else None
    print(f"chosen: {agreed or SCALINGS[int(mean.argmin())]}")


def _made(scaling: Scaling, seed: int) -> CnnClassifier:
    return CnnClassifier(scaling=scaling, random_state=seed)


if __name__ == "__main__":
    typer.run(main)
