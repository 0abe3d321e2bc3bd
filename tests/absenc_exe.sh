#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# absenc.exe in the place of absenc, for tests of the command: terminals become COM ports; other paths are paths of wine's
# drive Z, on which tests run. Virtual encoders and judges are those of Linux, because Windows has no pseudo-terminals.
case ${1-} in emulate | conform-host) exec "$ABSENC_LINUX" "$@" ;; esac

# Sets `port` to the COM port that leads to the terminal $1.
name_port() {
  number=20
  while [ "$(readlink "$WINEPREFIX/dosdevices/com$number")" != "$1" ] &&
    ! ln -s "$1" "$WINEPREFIX/dosdevices/com$number" 2>/dev/null; do
    number=$((number + 1))
  done
  port=COM$number
}

for argument; do
  shift
  settings=${argument#"${argument%%\?*}"}
  place=${argument%"$settings"}
  protocol=${place%"${place#*:/}"}
  protocol=${protocol%/}
  path=${place#"$protocol"}
  if [ -c "$path" ] && [ "$path" != /dev/null ] && [ "$path" != /dev/zero ]; then
    name_port "$(readlink -f "$path")"
    argument=$protocol$port$settings
  fi
  set -- "$@" "$argument"
done
exec "$WINE" "$ABSENC_EXE" "$@"
