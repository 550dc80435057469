"""List the packages of the wheel. All other settings are in pyproject.toml.

Some folders are at the top of the repository, because people edit them. A wheel contains them in
`ajgdata`: `reports` as `ajgdata.reports`. pyproject.toml can list packages or search for them, but
not do both.

PyPI shows the README without the other files of the repository, so its links become absolute.
"""

import re
import tomllib
from pathlib import Path

from setuptools import find_packages, setup

ROOT = Path(__file__).parent
#: Folders of files that are not modules, with their subfolders.
FOLDERS = {
    "config": ["config.yaml"],
    "datasets": ["*/*.yaml", "*.json"],
    "profiles": ["*/*.yaml"],
    "reports": ["*.yaml", "*/*.md", "variants/*.yaml", "templates/*"],
    "workflow": ["Snakefile", "rules/*", "schemas/*", "scripts/*", "report/*"],
}
#: The console of a run. Snakemake finds it by its name, so it is at the top of a wheel.
CONSOLE = "snakemake_logger_plugin_job_lines"


def readme() -> str:
    """Return the README with links to the files of this version in the repository."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    source = project["urls"]["Source"]
    tag = f"v{project['version']}"
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    # `![...](docs/images/opening.png)` is a picture, `[...](docs/index.md)` is a link.
    text = re.sub(r"(!\[[^]]*\]\()(?!https?:)", rf"\1{source}/raw/{tag}/", text)
    return re.sub(r"(?<!!)(\[[^]]*\]\()(?!https?:)", rf"\1{source}/blob/{tag}/", text)


setup(
    long_description=readme(),
    long_description_content_type="text/markdown",
    packages=[
        *find_packages(include=["ajgdata*"]),
        *("ajgdata.new_project", "ajgdata.samples"),
        *(f"ajgdata.{name}" for name in FOLDERS),
        CONSOLE,
    ],
    package_dir={
        CONSOLE: f"workflow/logger/{CONSOLE}",
        **{f"ajgdata.{name}": name for name in FOLDERS},
    },
    package_data={
        "ajgdata": ["py.typed"],
        "ajgdata.new_project": ["*"],
        "ajgdata.samples": ["*.nc"],
        "ajgdata.studies": ["*.yaml"],
        **{f"ajgdata.{name}": patterns for name, patterns in FOLDERS.items()},
    },
)
