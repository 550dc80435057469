"""List the packages of the wheel. All other settings are in pyproject.toml.

Some folders are at the top of the repository, because people edit them. A wheel contains them in
`ajgdata`: `reports` as `ajgdata.reports`. pyproject.toml can list packages or search for them, but
not do both.
"""

from setuptools import find_packages, setup

#: Folders of files that are not modules, with their subfolders.
FOLDERS = {
    "datasets": ["*/*.yaml", "*.json"],
    "profiles": ["*/*.yaml"],
    "reports": ["*.yaml", "*/*.md", "variants/*.yaml", "templates/*"],
    "workflow": ["Snakefile", "rules/*", "schemas/*", "scripts/*", "report/*"],
}
#: The console of a run. Snakemake finds it by its name, so it is at the top of a wheel.
CONSOLE = "snakemake_logger_plugin_job_lines"

setup(
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
        "ajgdata.new_project": ["*"],
        "ajgdata.samples": ["*.nc"],
        "ajgdata.studies": ["*.yaml"],
        **{f"ajgdata.{name}": patterns for name, patterns in FOLDERS.items()},
    },
)
