#!/usr/bin/env bash
# What the library weighs in a program of somebody else's (tests/user): packages, seconds of a clean
# release build, bytes of the program.
#
#   benches/weight.sh                     one table
#   benches/weight.sh --runs 3            the median of three clean builds
#
# Built with `default-features = false`, and nothing beside it; then with glam and nalgebra, whose
# vectors the program uses. Sources are fetched before. Nothing else should run meanwhile: seconds
# are of the wall, on all processors.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../tests/user"

runs=1
while (($# > 0)); do
    case "$1" in
        --runs)
            [[ "${2:-}" =~ ^[1-9][0-9]*$ ]] ||
                { echo "weight.sh: --runs needs a number" >&2; exit 2; }
            runs=$2
            shift 2
            ;;
        *) echo "weight.sh: unknown argument $1; there is --runs only" >&2; exit 2 ;;
    esac
done

target=$(mktemp -d)
trap 'rm -rf "$target"' EXIT
export CARGO_TARGET_DIR=$target
program=$target/release/planisphere-user

cargo fetch --locked --quiet

packages() {
    cargo tree --locked --edges normal --prefix none --format '{p}' "$@" |
        sed 's/ (\*)$//' | sort --unique | wc --lines
}

# Seconds of a clean build with some arguments: the median of the runs.
seconds() {
    local run start=() took=()
    for ((run = 0; run < runs; run++)); do
        rm -rf "${target:?}"/*
        start=$(date +%s%N)
        cargo build --release --locked --quiet "$@"
        took+=($((($(date +%s%N) - start) / 100000000)))
    done
    printf '%s\n' "${took[@]}" | sort --numeric-sort | sed --quiet "$(((runs + 1) / 2))p" |
        sed 's/.$/.&/; s/^\./0./'
}

# Bytes with symbols as the profile has them, and where all crates are compiled as one.
bytes() {
    stat --format=%s "$program"
}

row() {
    printf '%-44s %9s %9s %11s %11s\n' "$@"
}

row "the program, and" "packages" "build, s" "bytes" "lto, bytes"
for with in "planisphere alone:--no-default-features" "glam, nalgebra as well:"; do
    name=${with%%:*} arguments=()
    [[ -z "${with#*:}" ]] || arguments=("${with#*:}")
    count=$(packages "${arguments[@]}")
    took=$(seconds "${arguments[@]}")
    plain=$(bytes)
    CARGO_PROFILE_RELEASE_LTO=fat cargo build --release --locked --quiet "${arguments[@]}"
    row "$name" "$count" "$took" "$plain" "$(bytes)"
done
printf '%s, %s processors, the median of %s\n' "$(rustc --version)" "$(nproc)" "$runs"
