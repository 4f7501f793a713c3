#!/bin/busybox sh
# The initrd's only program: mounts the disks as one tree, then starts systemd.
b=/bin/busybox
$b mkdir -p /proc /sys /dev /base /system /over /root
$b mount -t proc proc /proc
$b mount -t sysfs sysfs /sys
$b mount -t devtmpfs dev /dev
for module in /*.ko; do $b insmod $module; done
$b mount -t squashfs -o ro /dev/vda /base
$b mount -t squashfs -o ro /dev/vdb /system
$b mount -t tmpfs over /over
$b mkdir -p /over/upper /over/work
$b mount -t overlay -o lowerdir=/system:/base,upperdir=/over/upper,workdir=/over/work overlay /root
$b mount --move /dev /root/dev
$b umount /proc /sys
exec $b switch_root /root /sbin/init
