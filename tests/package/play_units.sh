#!/bin/sh
# systemctl of a machine where systemd does not run: starts and stops the units of this project by what they say.
# User, groups and folders are those of the unit; its sandbox is not made. Everything else is written to the log.
run=/run/played
mkdir -p $run
echo "systemctl $*" >>$run/calls
verb=$1
shift

of_unit() { sed -n "s/^$1=//p" "/lib/systemd/system/$unit.service" | tail -1; }

start() {
  is_running && return
  user=$(of_unit User)
  user=${user:-nobody}  # DynamicUser=
  own="-d -o $user -g $(id -gn "$user")"
  install $own "/run/$(of_unit RuntimeDirectory)"
  [ -d "/var/lib/$(of_unit StateDirectory)" ] || install $own "/var/lib/$(of_unit StateDirectory)"
  groups=$(of_unit SupplementaryGroups | tr ' ' ,)
  [ -n "$groups" ] && groups="--groups $groups" || groups=--clear-groups
  RUNTIME_DIRECTORY=/run/$(of_unit RuntimeDirectory) STATE_DIRECTORY=/var/lib/$(of_unit StateDirectory) \
    setsid setpriv --reuid "$user" --regid "$(id -g "$user")" $groups $(of_unit ExecStart) >>"/var/log/$unit.log" 2>&1 &
  echo $! >"$run/$unit"
  for _ in $(seq 300); do
    [ -S "/run/$(of_unit RuntimeDirectory)/api.sock" ] && return
    is_running || break
    sleep 0.2
  done
  echo "Job for $unit.service failed: $(tail -1 "/var/log/$unit.log")" >&2
  exit 1
}

# Nothing waits for a process that has ended.
is_running() { grep -qs 'State:.[^Z]' "/proc/$(cat "$run/$unit" 2>/dev/null)/status"; }

stop() {
  is_running || return 0
  kill "$(cat "$run/$unit")"
  while is_running; do sleep 0.2; done
  rm -f "/run/$(of_unit RuntimeDirectory)/api.sock"
}

for unit in "$@"; do
  unit=${unit%.service}
  case "$verb $unit" in
    "start scanrigd" | "start scanrigd-sim") start ;;
    "stop scanrigd" | "stop scanrigd-sim") stop ;;
    "restart scanrigd") stop; start ;;
    "is-active scanrigd" | "is-active scanrigd-sim") is_running || exit 3 ;;
  esac
done
