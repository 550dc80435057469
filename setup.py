"""List the packages of the wheel. All other settings are in pyproject.toml.

People edit `reports/`, so this folder is at the top of the repository. A wheel contains it as
`ajgdata.reports`. pyproject.toml can list packages or search for them, but not do both.
"""

from setuptools import find_packages, setup

REPORTS = [
    "ajgdata.reports",
    "ajgdata.reports.experiments",
    "ajgdata.reports.pages",
    "ajgdata.reports.templates",
]

setup(
    packages=[*find_packages(include=["ajgdata*"]), "ajgdata.samples", *REPORTS],
    package_dir={"ajgdata.reports": "reports"},
)
