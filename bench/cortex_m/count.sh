#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# usage: bench/cortex_m/count.sh
# Instructions that a BiSS frame costs on a Cortex-M0+ and a Cortex-M4, counted by QEMU. Needs the packages
# gcc-arm-none-eabi, libstdc++-arm-none-eabi-newlib and qemu-user.
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# executed CPU OPTIMISATION WAY FRAMES
executed() {
  arm-none-eabi-g++ -std=c++20 "$2" -DNDEBUG -DWAY="$3" -DFRAMES="$4" -mcpu="$1" -mthumb -ffreestanding -fno-exceptions -fno-rtti \
    -fno-threadsafe-statics -ffunction-sections -fdata-sections -Wl,--gc-sections -nostartfiles -I. \
    bench/cortex_m/biss.cpp -o "$work/program"
  qemu-arm -singlestep -d exec,nochain -D "$work/log" "$work/program" || { echo 'a wrong position' >&2; exit 1; }
  grep -c '^Trace' "$work/log"
}

ways=('known at compile time' 'known at run time' 'the peer')
for cpu in cortex-m0plus cortex-m4; do
  for optimisation in -O2; do
    for way in "${!ways[@]}"; do
      none=$(executed $cpu $optimisation "$way" 0)
      all=$(executed $cpu $optimisation "$way" 64)
      echo "$cpu $optimisation ${ways[way]}: $(((all - none) / 64)) instructions a frame"
    done
  done
done
