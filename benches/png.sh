#!/usr/bin/env bash
# Measures how long a picture takes to become a PNG, and how large that is: RGB, as `render` writes
# it, against a palette, in one run, in turn. Two pictures: the README's, and a million spheres
# (`planisphere make cloud`, 1024 x 1024).
#
#   benches/png.sh              medians of 21 rounds
#   benches/png.sh --runs 51    of more; arguments go to `planisphere bench png`
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

cargo build --release --quiet
ours=${PLANISPHERE:-${CARGO_TARGET_DIR:-target}/release/planisphere}

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$ours" make cloud "$folder" --count 1e6 2>/dev/null
# The cloud as scenes/cloud.toml looks at it.
sed '/^\[\[spheres\]\]/q' scenes/cloud.toml >"$folder/cloud-1e6.toml"
printf '%s = "%s.npy"\n' centers centers radii radii colors colors >>"$folder/cloud-1e6.toml"
cp scenes/first.toml "$folder"

cd "$folder"
case "$ours" in
    /*) ;;
    *) ours=$OLDPWD/$ours ;;
esac
date '+%-d %B %Y'
uptime | sed 's/.*load/load/'
"$ours" bench png first.toml cloud-1e6.toml "$@"
