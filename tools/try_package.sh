#!/bin/sh
# Make a project in an empty folder with the installed `ajgdata`, and run it up to its report.
# CI and the container call it after the installation of the package with the extra `simulate` or `all`.
set -eu
example=$(realpath "$(dirname "$0")/../docs/examples/make_takes.py")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python "$example" recordings
ajgdata new project
cd project
ajgdata import ../recordings --dataset mine
ajgdata check mine
ajgdata run mine
test -f results/runs/mine/report/index.html
