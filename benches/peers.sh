#!/usr/bin/env bash
# Measures planisphere's CPU device side by side with other programs that draw spheres: the same
# arrays, the same view, the same machine, in turn.
#
#   benches/peers.sh                      1e3 to 1e6 spheres
#   benches/peers.sh --max 1e7            and 1e7
#   benches/peers.sh --runs 9 --frames 9  more repetitions
#
# The scene: equal spheres at random places in a unit cube, 7 % of its volume, seen obliquely by
# parallel rays, 1024 x 1024. Embree 3 (ray packets marked as coherent, all cores;
# benches/peers/embree.cpp) writes the id array as planisphere does. It is given the spheres in
# three ways, each built in low and in medium quality: points   its own sphere points: the usual
# way, and the slowest spheres  one user geometry with a primitive for each sphere, and a callback
# of 16 rays at once (AVX-512; 8 with AVX2) groups   one user geometry with a primitive for each 8
# neighbours along a Morton curve, and the same callback Tachyon and POV-Ray cannot: they read a
# scene text and write an uncompressed picture, without shading or shadows.
#
# On Debian and Ubuntu the others come by apt-get install g++ libembree-dev libtbb-dev tachyon
#   povray (Debian 12 has Embree 3.13; releases with Embree 4 only do not have this interface.) What
#   is missing is skipped, loudly.
#
# Ratios are theirs over ours, round by round: above 1 planisphere is faster. cpu is processor time
# of all threads, which other work on the machine disturbs less than wall time. The processes run
# one after another in each round; medians are of the rounds after one that does not count.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

runs=5 frames=7 most=1000000
# Readers of text are slow: up to so many spheres.
most_tachyon=1000000 most_povray=100000
side=1024 width=1.9
origin=(10.5 10.5 8.0) view=(-1 -1 -0.75) up=(0 0 1)

usage() {
    sed -n '2,/^set /{/^set /d; s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"
}

whole() {
    awk -v text="$1" 'BEGIN { if (text !~ /^[0-9]+(e[0-9]+)?$/) exit 1; printf "%d", text }' ||
        { echo "peers.sh: $1 is not a number such as 1000 or 1e6" >&2; exit 2; }
}

while (($# > 0)); do
    case "$1" in
        --max | --runs | --frames)
            (($# > 1)) || { echo "peers.sh: $1 needs a number" >&2; exit 2; }
            value=$(whole "$2")
            case "$1" in
                --max) most=$value ;;
                --runs) runs=$value ;;
                --frames) frames=$value ;;
            esac
            shift 2
            ;;
        --help | -h) usage; exit 0 ;;
        *) echo "peers.sh: unknown argument $1; see --help" >&2; exit 2 ;;
    esac
done

skip() {
    printf '\n*** SKIPPED: %s ***\n' "$*"
}

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

cargo build --release --quiet
ours=${PLANISPHERE:-${CARGO_TARGET_DIR:-target}/release/planisphere}

embree=
if ! command -v g++ >/dev/null; then
    skip "Embree: there is no g++ (apt-get install g++ libembree-dev libtbb-dev)"
elif ! g++ -O3 -march=native -std=c++17 -o "$folder/embree" benches/peers/embree.cpp \
    -lembree3 -ltbb 2>"$folder/errors"; then
    skip "Embree: its program does not build (apt-get install libembree-dev libtbb-dev):" \
        "$(head -n 1 "$folder/errors")"
else
    embree=$folder/embree
fi
tachyon=$(command -v tachyon || true)
povray=$(command -v povray || true)
[[ -n "$tachyon" ]] || skip "Tachyon: it is not installed (apt-get install tachyon)"
[[ -n "$povray" ]] || skip "POV-Ray: it is not installed (apt-get install povray)"

# The numbers of centers.npy, three to a line. Arrays of this shape begin at byte 128.
centers() {
    od --address-radix=n --output-duplicates --format=fF --width=12 --skip-bytes=128 \
        "$folder/centers.npy"
}

# The radius of all spheres.
radius() {
    od --address-radix=n --format=fF --skip-bytes=128 --read-bytes=4 "$folder/radii.npy" | tr -d ' '
}

write_tachyon() {
    {
        echo "BEGIN_SCENE"
        echo "RESOLUTION $side $side"
        local zoom
        zoom=$(awk -v w="$width" 'BEGIN { print 2 / w }')
        echo "CAMERA PROJECTION ORTHOGRAPHIC ZOOM $zoom ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH 1"
        # Tachyon's world is left-handed: the picture is ours mirrored, which costs it nothing.
        echo "CENTER ${origin[*]} VIEWDIR ${view[*]} UPDIR ${up[*]} END_CAMERA"
        echo "TEXDEF t AMBIENT 1 DIFFUSE 0 SPECULAR 0 OPACITY 1 COLOR 1 1 1 TEXFUNC 0"
        centers | awk -v r="$1" '{ print "SPHERE CENTER", $1, $2, $3, "RAD", r, "t" }'
        echo "END_SCENE"
    } >"$folder/scene.dat"
}

write_povray() {
    local join
    join() { local IFS=,; echo "<$*>"; }
    {
        echo "#version 3.7;"
        echo "#default { pigment { rgb 1 } finish { ambient 1 diffuse 0 } }"
        echo "camera { orthographic location $(join "${origin[@]}") direction $(join "${view[@]}")"
        # right = view x up, of the width of the picture; up completes it.
        awk -v w="$width" -v v="${view[*]}" -v u="${up[*]}" 'BEGIN {
            split(v, a, " "); split(u, b, " ")
            x = a[2] * b[3] - a[3] * b[2]
            y = a[3] * b[1] - a[1] * b[3]
            z = a[1] * b[2] - a[2] * b[1]
            n = w / sqrt(x * x + y * y + z * z); x *= n; y *= n; z *= n
            p = y * a[3] - z * a[2]; q = z * a[1] - x * a[3]; s = x * a[2] - y * a[1]
            m = w / sqrt(p * p + q * q + s * s)
            printf "right <%.9f,%.9f,%.9f> up <%.9f,%.9f,%.9f> }\n", x, y, z, p * m, q * m, s * m }'
        centers | awk -v r="$1" '{ print "sphere { <" $1 "," $2 "," $3 ">," r " }" }'
    } >"$folder/scene.pov"
}

# Median milliseconds of a moved frame of ours, wall and processor time, one process.
our_frame() {
    local number='\([0-9.e+-]*\)'
    "$ours" bench speed --scene "$folder/peer.toml" --device cpu --frames "$frames" --runs 0 \
        --no-baselines --json 2>/dev/null |
        sed "s/.*\"moved\":{\"wall\":{\"median\":$number[^}]*},\"cpu\":{\"median\":$number.*/\1 \2/"
}

# How the spheres are given, build quality, ids, frames.
embree_arguments() {
    echo "$folder/centers.npy $r ${origin[*]} ${view[*]} ${up[*]} $width $side $1 $2 $3 $4"
}

# The median of a column of the frames, against one way to give the spheres.
column() {
    awk -v k="$2" '{ print $k }' "$folder/frames.$1" | sort -g | awk '
        { v[NR] = $1 }
        END { print NR % 2 ? v[(NR + 1) / 2] : (v[NR / 2] + v[NR / 2 + 1]) / 2 }'
}

printf '%s; %s, %s processors; load %s; medians of %s rounds, of %s frames each\n' \
    "$(date '+%-d %B %Y')" "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)" \
    "$(nproc)" "$(cut -d ' ' -f 1-3 /proc/loadavg)" "$runs" "$frames"
printf 'Embree user geometry is tested for %s rays at once\n' \
    "$(grep -q -m 1 avx512f /proc/cpuinfo && echo 16 || echo 8)"

for ((count = 1000; count <= most; count *= 10)); do
    "$ours" make cloud "$folder" --count "$count" 2>/dev/null
    r=$(radius)
    {
        echo "[camera]"
        (IFS=,; echo "origin = [${origin[*]}]"; echo "view = [${view[*]}]"; echo "up = [${up[*]}]")
        printf 'width = %s\n[image]\nwidth = %s\nheight = %s\n' "$width" "$side" "$side"
        printf '[[spheres]]\ncenters = "centers.npy"\nradius = %s\n' "$r"
    } >"$folder/peer.toml"

    printf '\n%s spheres, whole process\n' "$count"
    names=planisphere
    commands=("$ours" render "$folder/peer.toml" -o none --ids "$folder/ours.npy" --device cpu)
    if [[ -n "$embree" ]]; then
        for given in points spheres groups; do
            for quality in low medium; do
                names+=",Embree $given ($quality build)"
                read -ra arguments < <(embree_arguments "$given" "$quality" "$folder/embree.npy" 0)
                commands+=(::: "$embree" "${arguments[@]}")
            done
        done
    fi
    if [[ -n "$tachyon" ]]; then
        if ((count <= most_tachyon)); then
            write_tachyon "$r"
            names+=",Tachyon"
            commands+=(::: "$tachyon" "$folder/scene.dat" -lowestshade -format PPM \
                -o "$folder/tachyon.ppm")
        else
            skip "Tachyon: more than $most_tachyon spheres take too long"
        fi
    fi
    if [[ -n "$povray" ]]; then
        if ((count <= most_povray)); then
            write_povray "$r"
            names+=",POV-Ray"
            commands+=(::: "$povray" "+W$side" "+H$side" +Q0 -A -D -GA +FP \
                "+O$folder/povray.ppm" "$folder/scene.pov")
        else
            skip "POV-Ray: more than $most_povray spheres take too long"
        fi
    fi
    "$ours" bench time --runs "$runs" --names "$names" -- "${commands[@]}"

    if [[ -n "$embree" ]]; then
        for given in points spheres groups; do
            read -ra arguments <<<"$(embree_arguments "$given" medium "$folder/embree.npy" 0)"
            printf 'Embree %s against the exact ids: %s\n' "$given" \
                "$("$embree" "${arguments[@]}" "$folder/ours.npy")"
        done
        rm -f "$folder"/frames.*
        for ((round = 0; round < runs; round++)); do
            a=$(our_frame)
            for given in points spheres groups; do
                read -ra arguments < \
                    <(embree_arguments "$given" medium "$folder/embree.npy" "$frames")
                b=$("$embree" "${arguments[@]}" | sed -n 's/^frame_ms //p')
                # Wall and processor time of ours, then of theirs, and both ratios.
                echo "$a $b" | awk '{ print $1, $2, $3, $4, $3 / $1, $4 / $2 }' \
                    >>"$folder/frames.$given"
            done
        done
        printf '%s spheres, a frame after the camera has moved, wall (cpu) ms\n' "$count"
        printf '  %-14s %8.2f (%.2f)\n' planisphere "$(column points 1)" "$(column points 2)"
        for given in points spheres groups; do
            printf '  %-14s %8.2f (%.2f), ratio %.2f (%.2f)\n' "Embree $given" \
                "$(column "$given" 3)" "$(column "$given" 4)" \
                "$(column "$given" 5)" "$(column "$given" 6)"
        done
    fi
done
