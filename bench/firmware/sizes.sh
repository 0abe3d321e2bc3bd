#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# usage: sizes.sh PROGRAM...
# Bytes of code, constants and RAM of firmware that reads positions, of each protocol.
set -euo pipefail
size=${SIZE:-arm-none-eabi-size}
printf '%-14s %8s %8s %8s\n' reader text rodata RAM
for program in "$@"; do
  "$size" -A "$program" | awk -v name="$(basename "$program" .elf)" '
    $1 ~ /^\.text/ { text += $2 }
    $1 ~ /^\.(rodata|ARM.ex)/ { rodata += $2 }
    $1 ~ /^\.(data|bss)/ { ram += $2 }
    END { printf "%-14s %8d %8d %8d\n", name, text, rodata, ram }'
done
