"""What each block says: a function of the results, by the name in its marker."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from ajgdata.ablations import ABLATIONS
from ajgdata.pipeline.stages import busy_s
from ajgdata.report.format import number
from tools import flame

from . import evaluations, simulation, sorting
from .documents import blocks_of
from .markdown import markdown_table
from .results import Results


def run_cost(results: Results) -> str:
    """Jobs of a run, their time and memory."""
    jobs = results.jobs()
    results.metric("size", "size", "cnn", "grouped", "rmse", "mean")  # names the commit
    minutes = number(busy_s(jobs) / 60, 2)
    processor = number(sum(job.cpu_s for job in jobs if job.cpu_s == job.cpu_s) / 60, 2)
    memory = number(max(job.peak_mb for job in jobs if job.peak_mb == job.peak_mb) / 1e3, 2)
    head = ("jobs", "time", "processor time", "memory, largest job", "`results/`")
    cells = (
        f"{len(jobs):,}", f"{minutes} min", f"{processor} min", f"{memory} GB",
        f"{number(results.size_gb(), 2)} GB",
    )  # fmt: skip
    return markdown_table(head, [cells])


def run_time(results: Results) -> str:
    """What the jobs of each rule took."""
    jobs = results.jobs()
    results.metric("size", "size", "cnn", "grouped", "rmse", "mean")  # names the commit
    return f"{flame.table(jobs)}\n"


BLOCKS: dict[str, Callable[[Results], str]] = {
    "results": evaluations.readme_table,
    "all-results": evaluations.headline_table,
    "run-cost": run_cost,
    "run-time": run_time,
    "after-the-choice": evaluations.after_the_choice,
    "media": evaluations.media,
    "live-sorting": sorting.live_sorting,
    "sort-live": sorting.sort_live,
    "default-grid": simulation.default_grid,
    "grid-sweep": simulation.grid_sweep,
    "grid-settings": simulation.grid_settings,
    "omissions": simulation.omissions,
    "omission-summary": simulation.omission_summary,
    "verification": simulation.verification,
    "stability": simulation.stability,
    "contact-estimates": simulation.contact_estimates,
    "material-distances": simulation.material_distances,
    **{f"ablation-{name}": partial(simulation.ablation, name=name) for name in ABLATIONS},
}


def block(name: str, results: Results) -> str:
    """Return the text of a block, with the run that it came from. Raises OSError where the run
    has not made what it needs."""
    text = BLOCKS[name](results)
    return f"\n{text}\n{results.name()}\n\n"


def drifted(text: str, results: Path) -> list[str]:
    """Return the names of the blocks of a document that say they were made of these results, and
    are not what these results give. Blocks of another run are none of them."""
    found = []
    for name, written in blocks_of(text).items():
        reading = Results(results)
        try:
            made = block(name, reading)
        except FileNotFoundError:  # pages that were not asked for
            continue
        if reading.name() in written and written != made:
            found.append(name)
    return found
