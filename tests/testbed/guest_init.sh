#!/bin/bash
# First process of the user-mode guest: the host's own files under an overlay, CAN modules, then systemd.
# The host passes MRCTL_BED=DIR on the kernel command line; DIR/bed.env names the paths to bind.
set -u
export PATH=/usr/sbin:/usr/bin:/sbin:/bin
die() { echo "guest_init: $*; halting"; /sbin/poweroff -f; }

mount -t proc proc /proc
mount -t sysfs sys /sys
# shellcheck source=/dev/null
. "$MRCTL_BED/bed.env" || die "no $MRCTL_BED/bed.env"

# Order matters: vcan needs can-dev. can-gw, can-bcm and the queueing disciplines stay out until a test asks.
modules=/usr/lib/uml/modules/$(uname -r)/kernel
for module in net/can/can net/can/can-raw drivers/net/can/dev/can-dev drivers/net/can/vcan fs/overlayfs/overlay; do
  insmod "$modules/$module.ko" || die "cannot load $module"
done

# Without the overlay, hostfs (mounted rw) would write straight into the host's files.
mount -t tmpfs tmpfs /mnt
mkdir /mnt/up /mnt/work /mnt/root
mount -t overlay overlay -o lowerdir=/,upperdir=/mnt/up,workdir=/mnt/work /mnt/root || die "no overlay"
root=/mnt/root

# The exchange directory is the one place where the guest writes the host's files, at the same path as there.
mount -t hostfs none -o "$MRCTL_BED" "$root$MRCTL_BED" || die "no exchange directory"

# A service with ProtectHome= and PrivateTmp= sees neither /home, /root nor /tmp, where an interpreter or a
# checkout may well be: bind them to where an installed mrctl would live.
for name in python site-packages src; do mkdir -p "$root/opt/mrctl/$name"; done
mount --bind "$root$BED_BASE_PREFIX" "$root/opt/mrctl/python"
mount --bind "$root$BED_SITE_PACKAGES" "$root/opt/mrctl/site-packages"
mount --bind "$root$BED_CHECKOUT" "$root/opt/mrctl/src"
mkdir -p "$root/opt/mrctl/bin"
cat >"$root/opt/mrctl/bin/mrctl" <<EOF
#!/bin/sh
export PYTHONPATH=/opt/mrctl/src:/opt/mrctl/site-packages PYTHONDONTWRITEBYTECODE=1
export LD_LIBRARY_PATH=/opt/mrctl/python/lib
exec /opt/mrctl/python/bin/$BED_PYTHON -m mrctl "\$@"
EOF
chmod 755 "$root/opt/mrctl/bin/mrctl"

# A systemd with nothing of the host's own services: only the journal and the command loop.
for directory in /etc/systemd/system /lib/systemd/system/sysinit.target.wants /lib/systemd/system-generators \
  /lib/systemd/system/local-fs.target.wants /lib/systemd/system/sockets.target.wants \
  /lib/systemd/system/timers.target.wants; do
  [ ! -d "$root$directory" ] || mount -t tmpfs -o mode=755 tmpfs "$root$directory"
done
rm -f "$root/etc/fstab" "$root/etc/machine-id"
echo 0123456789abcdef0123456789abcdef >"$root/etc/machine-id"
mkdir -p "$root/etc/systemd/journald.conf.d" "$root/etc/systemd/system"
printf '[Journal]\nStorage=volatile\nForwardToConsole=no\nRateLimitBurst=0\n' >"$root/etc/systemd/journald.conf.d/bed.conf"
cat >"$root/etc/systemd/system/bed.service" <<EOF
[Unit]
Description=Command loop of the test bed
DefaultDependencies=no
Wants=systemd-journald.service
After=systemd-journald.service
# However the loop ends (the host's end of the line closed: SIGHUP), the guest ends with it.
SuccessAction=poweroff-immediate
FailureAction=poweroff-immediate
[Service]
Type=exec
ExecStart=/bin/bash "$BED_HERE/guest_serve.sh"
Environment="MRCTL_BED=$MRCTL_BED"
EOF
printf '[Unit]\nDefaultDependencies=no\nRequires=bed.service\n' >"$root/etc/systemd/system/bed.target"

umount /sys
umount /proc
cd "$root" || die "no $root"
# Moved, not only chroot: the kernel refuses user namespaces (PrivateUsers=) to whoever sits in a chroot.
mount --move . / || die "cannot move the root"
exec chroot . /lib/systemd/systemd --unit=bed.target --show-status=no
