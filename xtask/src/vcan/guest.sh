# What the guest does: prepares its root, its interfaces, runs the command, powers off. Run by busybox
# as process 1. The task writes the variables that it begins with above this line: BUSYBOX, MODULES
# (the folder of the kernel's modules), TIME_LIMIT, FOLDER (the current one), WRITABLE.
set -u
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
JOB=${0%/init}
b() { "$BUSYBOX" "$@"; }
give_up() { b echo "guest: $*" >/dev/console; b poweroff -f; }
load() { b insmod "$MODULES/$1.ko"; }

b mount -t proc proc /proc
b mount -t devtmpfs dev /dev 2>/dev/null # the kernel has often done so itself

# The root: the machine's own below a layer in memory, and what may be written for good in its place.
load overlay || give_up "no overlay module"
b mount -t tmpfs -o mode=755 tmpfs "$JOB/uml" || give_up "no memory for the root"
ROOT=$JOB/uml/root
b mkdir "$JOB/uml/upper" "$JOB/uml/work" "$ROOT"
b mount -t overlay -o "lowerdir=/,upperdir=$JOB/uml/upper,workdir=$JOB/uml/work" overlay "$ROOT" ||
    give_up "no overlay"
b echo "$JOB
$WRITABLE" | while read -r folder; do
    [ -z "$folder" ] && continue
    b mkdir -p "$ROOT$folder"
    b mount -t hostfs -o "$folder" none "$ROOT$folder" || give_up "cannot mount $folder"
done
b mount -o bind /dev "$ROOT/dev"
b mount -t proc proc "$ROOT/proc"
b mount -t sysfs sys "$ROOT/sys"
b mkdir -p "$ROOT/dev/pts" "$ROOT/dev/shm"
b mount -t devpts -o mode=620,ptmxmode=666 devpts "$ROOT/dev/pts"
b mount -t tmpfs -o mode=1777 tmpfs "$ROOT/dev/shm"
b mount -t tmpfs -o mode=755 tmpfs "$ROOT/run"
b ln -sf /proc/self/fd "$ROOT/dev/fd"

# can-dev first: vcan and slcan are built on it. can-bcm is what python-can sends periodically with.
b ip link set lo up
for module in can-dev can can-raw can-bcm vcan; do load $module || give_up "cannot load $module"; done
for module in vxcan slcan; do load $module 2>/dev/null; done
for interface in vcan0 vcan1; do
    b ip link add dev $interface type vcan || give_up "cannot add $interface"
    b ip link set $interface up
done

# The second serial line comes from the task and stays silent. It ends with the task: nothing waits
# for this any more.
(
    b stty -F /dev/ttyS1 raw -echo
    b cat /dev/ttyS1 >/dev/null 2>&1
    b poweroff -f
) &

# The command's output goes to the serial line that is the task's standard output, through a pipe, so
# that the command sees no terminal. The first line is opened raw: it passes on every byte as it is.
b stty -F /dev/ttyS0 raw -echo
b mkfifo "$ROOT/run/output"
b cat <"$ROOT/run/output" >/dev/ttyS0 &
output=$!
exec 3>"$ROOT/run/output"
b touch "$ROOT$JOB/started"
b setsid "$BUSYBOX" chroot "$ROOT" /bin/sh -c '
    cd "$2" || exit 125
    . "$1/command.sh"' sh "$JOB" "$FOLDER" </dev/null >&3 2>&3 3>&- &
command=$!
(
    exec 3>&- >/dev/null 2>&1
    b sleep "$TIME_LIMIT"
    b touch "$ROOT$JOB/out-of-time"
    b kill -TERM -$command
    b sleep 3
    b kill -KILL -$command
) &
clock=$!
exec 3>&-
wait $command
status=$?
b kill -KILL $clock -$command 2>/dev/null # what it left running would hold the pipe open
waited=0
while b kill -0 $output 2>/dev/null && [ $waited -lt 50 ]; do
    b usleep 20000
    waited=$((waited + 1))
done
b stty -F /dev/ttyS0 sane # which waits until the line has sent everything

# The last thing written: without it, the run does not count.
b sync
b echo $status >"$ROOT$JOB/status.new" && b mv "$ROOT$JOB/status.new" "$ROOT$JOB/status"
b sync
b poweroff -f
