#!/usr/bin/env bash
# The test command of the README: sees that what the tests need is there, then runs all of them.
#
#   tests/run.sh                      every test
#   tests/run.sh --test window        arguments go to `cargo test`
#   PLANISPHERE_FAULTS=500,200 tests/run.sh --test faults -- kills_and_faults --nocapture
#                                     more kills and faults at random moments than the 60 and 40 of
#                                     every run
#
# What draws on a GPU is tested on two drivers, whose compilers share nothing: the one that is there
# (lavapipe, where there is no hardware), and then SwiftShader. That comes from Debian's
# chromium-common, of which two files are unpacked into the target folder, and nothing is installed.
# Elsewhere PLANISPHERE_SECOND_DRIVER names the driver's file, such as
# /opt/swiftshader/vk_swiftshader_icd.json; `none` leaves the second driver out. With arguments only
# the first is tested.
#
# Beside Rust the tests need a software Vulkan device, an X server without a screen (Xvfb), xdotool
# to press its keys, a Wayland compositor without one (weston), and the libraries that the window
# loads when it opens. On Debian and Ubuntu what is missing is installed, with sudo if need be;
# elsewhere this script says what is missing and stops. No test is ever skipped for lack of
# something.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# The Vulkan loader and Mesa's software device, the X server, the keys, the compositor, setpriv and
# prlimit, NumPy for the exercise of the documents; what counts instructions; what winit loads.
packages=(
    libvulkan1 mesa-vulkan-drivers xvfb xdotool weston util-linux python3-numpy
    valgrind libc6-dbg
    libx11-6 libx11-xcb1 libxcb1 libxcursor1 libxi6 libxkbcommon0 libxkbcommon-x11-0
    libwayland-client0
)

say() {
    printf 'tests/run.sh: %s\n' "$*" >&2
}

installed() {
    [[ "$(dpkg-query --show --showformat='${db:Status-Status}' "$1" 2>/dev/null)" == installed ]]
}

as_root() {
    if [[ "$(id -u)" == 0 ]]; then
        "$@"
    elif command -v sudo >/dev/null; then
        sudo "$@"
    else
        say "this needs root, and there is no sudo: $*"
        return 1
    fi
}

# An update may fail for a source that has nothing to do with what is wanted; the install decides.
refresh_lists() {
    as_root apt-get update --quiet ||
        say "apt-get update failed; trying with the lists that are there"
}

on_debian() {
    local package missing=()
    for package in "${packages[@]}"; do
        installed "$package" || missing+=("$package")
    done
    if ((${#missing[@]} > 0)); then
        say "installing ${missing[*]}"
        refresh_lists
        as_root env DEBIAN_FRONTEND=noninteractive \
            apt-get install --yes --quiet --no-install-recommends "${missing[@]}"
    fi
}

elsewhere() {
    local missing=() drivers
    command -v Xvfb >/dev/null || missing+=("Xvfb")
    command -v xdotool >/dev/null || missing+=("xdotool")
    command -v weston >/dev/null || missing+=("weston")
    "${PYTHON:-python3}" -c 'import numpy, tomllib' 2>/dev/null ||
        missing+=("a Python 3.11 with NumPy (PYTHON names one)")
    drivers=$(find {/usr/share,/usr/local/share,/etc}/vulkan/icd.d -name '*.json' \
        2>/dev/null || true)
    [[ -n "$drivers" || "$(uname -s)" != Linux ]] || missing+=("a Vulkan driver")
    if ((${#missing[@]} > 0)); then
        say "missing: ${missing[*]}. Install them and run this again:"
        say "  Fedora   dnf install mesa-vulkan-drivers vulkan-loader xorg-x11-server-Xvfb \\"
        say "           xdotool weston libxkbcommon-x11 libXcursor libXi python3-numpy"
        say "  Arch     pacman -S vulkan-swrast vulkan-icd-loader xorg-server-xvfb xdotool \\"
        say "           weston libxkbcommon-x11 libxcursor libxi python-numpy"
        say "  openSUSE zypper install libvulkan_lvp libvulkan1 xorg-x11-server-Xvfb \\"
        say "           weston libxkbcommon-x11-0 libXcursor1 libXi6 python3-numpy"
        say "Other systems: any Vulkan, Metal or DX12 driver, and an X server with Xvfb (XQuartz)."
        return 1
    fi
}

if command -v apt-get >/dev/null && command -v dpkg-query >/dev/null; then
    on_debian
else
    elsewhere
fi

# Unpacks SwiftShader into a folder, for good: a download is 31 MB.
unpack_swiftshader() {
    local folder=$1 work files=(libvk_swiftshader.so vk_swiftshader_icd.json)
    [[ -e "$folder/${files[0]}" && -e "$folder/${files[1]}" ]] && return
    say "fetching SwiftShader, a second Vulkan driver, from Debian's chromium-common"
    mkdir -p "$folder" && work=$(mktemp -d "$folder/download.XXXXXX") || return
    # The lists may be too old to have the package, or name a version that has gone.
    if ! (cd "$work" && apt-get download chromium-common >/dev/null 2>&1); then
        refresh_lists
        (cd "$work" && apt-get download chromium-common) || return
    fi
    dpkg-deb --fsys-tarfile "$work"/chromium-common_*.deb |
        tar --extract --directory "$work" --strip-components=4 \
            "${files[@]/#/./usr/lib/chromium/}" || return
    mv "$work/${files[0]}" "$work/${files[1]}" "$folder" && rm -r "$work"
}

# The second driver's file, in `second`; empty if it is left out.
find_second() {
    local folder=${CARGO_TARGET_DIR:-target}/swiftshader
    second=${PLANISPHERE_SECOND_DRIVER:-}
    if [[ "$second" == none ]]; then
        say "PLANISPHERE_SECOND_DRIVER=none: what draws on a GPU is tested on ONE driver only"
        second=
    elif [[ -n "$second" ]]; then
        [[ -e "$second" ]] || { say "PLANISPHERE_SECOND_DRIVER: there is no $second"; return 1; }
        second=$(realpath "$second")
    elif [[ -e /etc/debian_version ]] && grep --quiet '^ID=debian$' /etc/os-release; then
        unpack_swiftshader "$folder" || {
            say "SwiftShader cannot be had: see above. PLANISPHERE_SECOND_DRIVER=FILE names another"
            say "driver's .json, PLANISPHERE_SECOND_DRIVER=none leaves the second driver out."
            return 1
        }
        second=$(realpath "$folder/vk_swiftshader_icd.json")
    else
        say "missing: a second Vulkan driver. Set PLANISPHERE_SECOND_DRIVER to the .json file of"
        say "SwiftShader (Chromium and Chrome come with it: vk_swiftshader_icd.json), or to none,"
        say "which leaves the second driver out."
        return 1
    fi
}

second=
(($# > 0)) || find_second

failed=0

# All of them, also after one has failed.
cargo test --release --workspace --all-features --locked --no-fail-fast "$@" || failed=1

# What draws on a GPU, once more. The expected name keeps the loader from quietly taking another
# driver.
if [[ -n "$second" ]]; then
    on_second() {
        local expected=${PLANISPHERE_EXPECT_ADAPTER:-SwiftShader}
        VK_DRIVER_FILES=$second PLANISPHERE_EXPECT_ADAPTER=$expected \
            cargo test --release --workspace --all-features --locked --no-fail-fast "$@" || failed=1
    }
    say "once more, on the driver of $second"
    on_second --test gpu --test gpu_together
    # The goldens; corpus and fuzz; the emulator of what a device may do; parts; a window.
    on_second --test golden --test exactness --test adversary --test merge --test window \
        --test facade -- gpu the_emulator_is_the_device pictures_in_parts_are_the_whole
fi
((failed == 0))

# The library without any feature, which draws on the CPU; the program without GPU and window; and
# without the window, as on a machine that has no use for one.
cargo check --release --locked --no-default-features
cargo check --release --locked --no-default-features --features cli
cargo check --release --locked --no-default-features --features cli,gpu
# The library with each format alone.
for feature in png files read parts; do
    cargo check --release --locked --no-default-features --features "$feature"
done
