#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# usage: bench/cortex_m/count.sh [FOLDER]
# Counts, with QEMU, the instructions for decoding a BiSS frame on a Cortex-M0+ and a Cortex-M4, and prints the size of
# code and constants of the whole program. FOLDER has bissc_extract.h of mjbots/moteus (folder fw). Needs the packages
# gcc-arm-none-eabi, libstdc++-arm-none-eabi-newlib and qemu-user.
set -euo pipefail
peers=${1:+$(realpath "$1")}
cd "$(dirname "$0")/../.."
[[ -z $peers || -f $peers/bissc_extract.h ]] || { echo "count.sh: there is no bissc_extract.h in $peers" >&2; exit 2; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# executed CPU OPTIMISATION DECODER FRAMES: prints how many instructions a program executes that decodes FRAMES frames
executed() {
  arm-none-eabi-g++ -std=c++20 "$2" -DNDEBUG -DDECODER="$3" -DFRAMES="$4" -mcpu="$1" -mthumb -ffreestanding -fno-exceptions -fno-rtti \
    -fno-threadsafe-statics -ffunction-sections -fdata-sections -Wl,--gc-sections -nostartfiles -I. ${peers:+-I"$peers"} \
    bench/cortex_m/biss.cpp -o "$work/program"
  qemu-arm -singlestep -d exec,nochain -D "$work/log" "$work/program" || { echo 'a wrong position' >&2; exit 1; }
  grep -c '^Trace' "$work/log"
}

decoders=('known at compile time' 'known at run time' 'the peer')
[[ -z $peers ]] || decoders+=("moteus' own")
for cpu in cortex-m0plus cortex-m4; do
  for optimisation in -O2 -Os; do
    for decoder in "${!decoders[@]}"; do
      none=$(executed $cpu $optimisation "$decoder" 0)
      all=$(executed $cpu $optimisation "$decoder" 64)
      size=$(arm-none-eabi-size "$work/program" | awk 'NR == 2 { print $1 }')
      echo "$cpu $optimisation ${decoders[decoder]}: $(((all - none) / 64)) instructions a frame, $size bytes with the frames"
    done
  done
done
