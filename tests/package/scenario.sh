#!/bin/sh
# The packages on a bare machine whose systemd does not run: install, scan, upgrade, downgrade, remove, purge.
# Usage: scenario.sh install|rows FOLDER, with old/ and new/ of the packages in FOLDER. `install` needs the archive;
# `rows` runs in a network of its own: scanrig-sim own-network -- scenario.sh rows FOLDER.
# Prints "ok WHAT | FIGURE" or "NO WHAT | FIGURE", one line per row. What maintainer scripts ask of systemd is recorded.
set -u
packages=$2
stub=/stub
sim=/run/scanrig-sim/api.sock
real=/run/scanrig/api.sock
quick="--scale 0.25 --views 3 --voxel-mm 1 --operator helper"

row() {  # WHAT EXIT_CODE FIGURE
  [ "$2" -eq 0 ] && echo "ok $1 | $3" || echo "NO $1 | $3"
}

contains() { case "$1" in *"$2"*) return 0 ;; *) return 1 ;; esac; }
one_line() { tr '\n' ' ' | tail -c 300; }

install_packages() {
  echo force-unsafe-io >/etc/dpkg/dpkg.cfg.d/test  # this machine does not outlive the test
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$packages"/old/*.deb curl systemd \
    >/tmp/install.log 2>&1
  row "installed with apt" $? "$(dpkg-query -W -f '${Package} ${Version} ${db:Status-Status} ' 'scanrig*')"
}

# A systemd that runs for the maintainer scripts: it records, and stops and finds the process in $stub/pid.
make_stub() {
  mkdir -p $stub /run/systemd/system /run/scanrig
  cat >$stub/systemctl <<'S'
#!/bin/sh
echo "systemctl $*" >>/stub/calls
case "$*" in *is-active*scanrigd.service) kill -0 "$(cat /stub/pid)" 2>/dev/null ;; *is-active*) false ;; esac
S
  cat >$stub/deb-systemd-invoke <<'S'
#!/bin/sh
echo "invoke $*" >>/stub/calls
[ "$1 $2" = "restart scanrigd.service" ] || exit 0
kill "$(cat /stub/pid)"
while grep -qs 'State:.[^Z]' "/proc/$(cat /stub/pid)/status"; do sleep 0.1; done  # a child of the scenario
S
  chmod +x $stub/*
  # The kernel's settings are this machine's, not those of the machine around it.
  ln -sf /bin/true /usr/lib/systemd/systemd-sysctl
  : >$stub/pid  # of no process
  PATH=$stub:$PATH
}

calls() { cat $stub/calls 2>/dev/null; rm -f $stub/calls; }
wait_for() { for _ in $(seq 300); do "$@" && return 0; sleep 0.2; done; return 1; }

check_files() {
  verified=$(systemd-analyze verify scanrigd.service scanrigd.socket scanrigd-sim.service 2>&1 | grep -i scanrig)
  [ -z "$verified" ]
  row "units verified by systemd-analyze" $? "${verified:-nothing to report}"
  groups=$(id -nG scanrig | tr ' ' '\n' | sort | tr '\n' ' ')
  [ "$groups" = "dialout gpio plugdev scanrig video " ]
  row "user scanrig and its groups" $? "$groups"
  folders=$(stat -c '%n %U %a' /etc/scanrig /var/lib/scanrig | one_line)
  [ "$folders" = "/etc/scanrig root 755 /var/lib/scanrig scanrig 755 " ]
  row "folders made" $? "$folders"
  enabled=$(cd /etc/systemd/system && ls -- *.wants/ | grep scanrig | sort | tr '\n' ' ')
  [ "$enabled" = "scanrigd.service scanrigd.socket " ]
  row "units enabled" $? "$enabled"
  wrong=$(dpkg -V scanrig scanrig-sim | grep -v '/usr/share/\(doc\|man\)/')
  [ -z "$wrong" ]
  row "files as packed" $? "${wrong:-all}"
}

check_start() {
  install -m 0644 /usr/share/scanrig/rigs/example.toml /tmp/rig.toml
  said=$(dpkg -i "$packages"/old/*.deb 2>&1)
  contains "$said" "there is no /etc/scanrig/rig.toml" && ! contains "$(calls)" "invoke start"
  row "not started without rig.toml" $? "$(echo "$said" | grep '^scanrig: ' | one_line)"
  sed 's/^gear_ratio.*/gear_ratio = 0/' /tmp/rig.toml >/etc/scanrig/rig.toml
  said=$(dpkg -i "$packages"/old/*.deb 2>&1)
  contains "$said" "gear_ratio" && contains "$said" "not started with" && ! contains "$(calls)" "invoke start"
  row "not started with an invalid rig.toml" $? "$(echo "$said" | grep 'rig.toml' | one_line)"
  cp /tmp/rig.toml /etc/scanrig/rig.toml
  dpkg -i "$packages"/old/*.deb >/dev/null 2>&1
  calls | grep -q 'invoke start scanrigd.socket scanrigd.service'
  row "started with a valid rig.toml" $? "the shipped example"
}

check_page() {
  command=$(sed -n 's/^ExecStart=//p' /lib/systemd/system/scanrigd-sim.service)
  mkdir -p /run/scanrig-sim /var/lib/scanrig-sim
  begun=$(date +%s%N)
  ${command%--operator*} $quick --clock virtual >/tmp/sim.log 2>&1 &
  sim_pid=$!
  wait_for curl -sf --compressed -o /tmp/page.html http://127.0.0.1:8081/
  found=$?
  took=$((($(date +%s%N) - begun) / 1000000))
  row "first page from 127.0.0.1" $found "$(wc -c </tmp/page.html) bytes, $took ms after the start"
  script=$(grep -o '/assets/main-[^"]*\.js' /tmp/page.html | head -1)
  [ -n "$script" ] && curl -sf --compressed -o /tmp/main.js "http://127.0.0.1:8081$script"
  row "its script" $? "$script, $(wc -c </tmp/main.js) bytes"
  address=$(scanrig open --role engineer --socket $sim | head -1)
  contains "$address" "http://127.0.0.1:8081/#code="
  row "address with a login" $? "${address%code=*}code=..."
}

check_scan() {
  wait_for sh -c "scanrig status --socket $sim | grep -q Ready"
  said=$(scanrig start --follow --socket $sim 2>&1)
  row "a whole simulated job" $? "$(echo "$said" | tail -1)"
  id=$(ls /var/lib/scanrig-sim/jobs | grep -v '[.]' | head -1)
  [ -s "/var/lib/scanrig-sim/jobs/$id/model/model.glb" ]
  row "its model" $? "$(stat -c %s "/var/lib/scanrig-sim/jobs/$id/model/model.glb" 2>&1) bytes"
  kill "$sim_pid"
  wait
}

# The service's part is played by the simulated one, at the service's socket and with the service's folder.
serve() {
  scanrigd-sim --socket $real --jobs /var/lib/scanrig/jobs $quick "$@" >>/tmp/serve.log 2>&1 &
  echo $! >$stub/pid
  wait_for sh -c "scanrig status 2>/dev/null | grep -q Ready"
}

stop_serving() { kill "$(cat $stub/pid)" 2>/dev/null; wait; }

check_upgrade() {
  serve --clock virtual
  scanrig start --follow >/dev/null 2>&1
  scanrig queue >/dev/null 2>&1
  done_id=$(ls /var/lib/scanrig/jobs | grep -v '[.]' | sort | head -1)
  stop_serving
  serve --clock real
  scanrig start >/dev/null 2>&1
  wait_for sh -c "scanrig status | grep -q '^  job: '"
  sleep 3
  id=$(scanrig status | sed -n 's/^  job: //p')
  said=$(dpkg -i "$packages"/new/*.deb 2>&1)
  row "upgraded with a job running" $? "$(dpkg-query -W -f '${Version}' scanrig)"
  [ -n "$id" ] && contains "$said" "interrupted job $id"
  row "the interrupted job is named" $? "$(echo "$said" | grep '^scanrig: ' | one_line)"
  stop_serving
  serve --clock virtual
  after=$(scanrig jobs)
  echo "$after" | grep "$id" | grep -q interrupted && echo "$after" | grep -q "$done_id"
  row "jobs after the upgrade" $? "$(echo "$after" | one_line)"
  stop_serving
}

check_downgrade() {
  before=$(dpkg-query -W -f '${Version}' scanrig)
  said=$(dpkg -i "$packages"/old/scanrig_*.deb 2>&1)
  [ $? -ne 0 ] && contains "$said" "is older than the installed $before" &&
    [ "$(dpkg-query -W -f '${Version} ${db:Status-Status}' scanrig)" = "$before installed" ]
  row "downgrade refused" $? "$(echo "$said" | grep '^scanrig: ' | one_line)"
}

check_removal() {
  jobs=$(ls /var/lib/scanrig/jobs | grep -vc '[.]')
  calls >/dev/null
  dpkg -r scanrig-sim scanrig >/tmp/remove.log 2>&1 &&
    contains "$(calls)" "invoke stop scanrigd.socket scanrigd.service" &&
    [ -e /etc/scanrig/rig.toml ] && [ ! -e /usr/bin/scanrigd ]
  row "removed" $? "service stopped, rig.toml kept"
  said=$(dpkg -P scanrig-sim scanrig 2>&1)
  [ ! -e /etc/scanrig ] && [ "$(ls /var/lib/scanrig/jobs | grep -vc '[.]')" = "$jobs" ] &&
    contains "$said" "are kept in /var/lib/scanrig"
  row "purged: configuration gone, jobs kept" $? "$jobs jobs; $(echo "$said" | grep '^scanrig: ' | one_line)"
  left=$(find /etc /lib/systemd /usr/bin /usr/share /var/lib/systemd -name '*scanrig*' 2>/dev/null | one_line)
  [ -z "$left" ]
  row "nothing else left" $? "${left:-nothing}"
  dpkg -i "$packages"/old/*.deb >/dev/null 2>&1
  SCANRIG_PURGE_JOBS=yes dpkg -P scanrig-sim scanrig >/dev/null 2>&1 && [ ! -e /var/lib/scanrig ]
  row "purged with SCANRIG_PURGE_JOBS=yes: jobs gone" $? "no /var/lib/scanrig"
}

case "$1" in
  install) install_packages ;;
  rows)
    check_files
    make_stub
    check_start
    check_page
    check_scan
    check_upgrade
    check_downgrade
    check_removal
    exit 0 ;;
esac
