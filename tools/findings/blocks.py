"""What each block says: a function of the results, by the name in its marker."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from ajgdata.ablations import ABLATIONS
from ajgdata.report.format import number
from ajgdata.store.benchmarks import RuleCost, cost_by_rule

from . import evaluations, simulation, sorting
from .documents import blocks_of
from .markdown import markdown_table
from .results import Results


def run_cost(results: Results) -> str:
    """Jobs of a run, their time and memory, and the size of the results."""
    *_, total = _costs(results)
    head = ("jobs", "run time of all jobs", "CPU time", "memory, largest job", "`results/`")
    cells = (
        f"{total.jobs:,}",
        f"{number(total.wall_s / 60, 2)} min",
        f"{number(total.cpu_s / 60, 2)} min",
        f"{number(total.peak_mb / 1e3, 2)} GB",
        f"{number(results.size_gb(), 2)} GB",
    )
    return markdown_table(head, [cells])


def run_time(results: Results) -> str:
    """Cost of the jobs of each rule."""
    rows = [
        (one.rule, f"{one.jobs}", f"{one.wall_s:,.0f}", f"{one.cpu_s:,.0f}", f"{one.peak_mb:,.0f}")
        for one in _costs(results)
    ]
    return markdown_table(("rule", "jobs", "run time, s", "CPU time, s", "largest job, MB"), rows)


def _costs(results: Results) -> list[RuleCost]:
    costs = cost_by_rule(results.jobs())
    results.metric("size", "size", "cnn", "grouped", "rmse", "mean")  # names the commit
    return costs


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
