#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# usage: freestanding.sh LINKED.o OBJECT.o...
# Fails if the linked object needs symbols other than those allowed below, which the compiler and its C library provide,
# or if an object that is not from tests/ has initialized data in writable memory. Prints the sizes of the objects.
set -euo pipefail
nm=${NM:-arm-none-eabi-nm}
size=${SIZE:-arm-none-eabi-size}

# The symbol __aeabi_atexit, which registers destructors of global objects, is forbidden.
forbidden='^__aeabi_atexit$'
allowed=(
  memcpy memmove memset memcmp strlen
  '__aeabi_[a-z0-9_]+'
  '__gnu_thumb1_case_[a-z]+'
  '__[a-z]+[sd]i[23]'  # allows functions of libgcc, such as __popcountsi2 and __clzdi2
  # the compiler enters __cxa_pure_virtual for each pure virtual function in a virtual table; it is never called
  __cxa_pure_virtual
)
pattern=$(IFS='|'; echo "^(${allowed[*]})\$")

linked=$1
shift
status=0
while read -r _ symbol; do
  if [[ $symbol =~ $pattern && ! $symbol =~ $forbidden ]]; then continue; fi
  status=1
  for object in "$@"; do
    if "$nm" -u "$object" | grep -qw -- "$symbol"; then
      echo "not freestanding: ${object#"$PWD"/} needs $(c++filt "$symbol")" >&2
    fi
  done
done < <("$nm" -u "$linked")

for object in "$@"; do
  if [[ $object == *tests/* ]]; then continue; fi
  while read -r _ _ symbol; do
    status=1
    echo "in RAM: ${object#"$PWD"/} has $(c++filt "$symbol"); say \`constexpr auto x = std::array{...}\`" >&2
  done < <("$nm" "$object" | grep -E ' [dD] [^$]' || true)
done

"$size" "$linked" "$@" | sed -E "s|$PWD/(CMakeFiles/[^/]*/\./)?||"
exit $status
