#!/usr/bin/env bash
# Runs reproduce.sbatch on a real Slurm: sets up a cluster of this one machine with two slots that is thrown away
# afterwards, submits the array and the merge for a few scenes, and compares every byte with a single run.
#
# Installs nothing. Needs Debian's slurm-wlm (which brings munge), and root, because the daemons are started here
# by hand: munged with a key of its own, then slurmctld and slurmd with a configuration of their own.
#
#   deploy/slurm/try.sh [PROGRAM]      FLAGS="--scenes 4 --people 3" unless the environment says otherwise
set -euo pipefail
cd "$(dirname "$0")/../.."
for daemon in munged slurmctld slurmd sbatch; do
    command -v "$daemon" >/dev/null || { echo "$daemon: not here; apt-get install slurm-wlm" >&2; exit 1; }
done
[ "$(id -u)" = 0 ] || { echo "needs root to start the daemons" >&2; exit 1; }
UMBRACAST="$(realpath "${1:-${CARGO_TARGET_DIR:-target}/release/umbracast}")"
FLAGS="${FLAGS:---scenes 4 --people 3}"
export UMBRACAST FLAGS

lab="$(mktemp -d)"
node="$(hostname -s)"
tell() { sed "s|$lab|/tmp/try|g; s|$node|node|g"; }
chmod 755 "$lab" # munged insists
pids=()
clear_up() {
    for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
    wait
    rm -rf "$lab"
}
trap clear_up EXIT

mkdir "$lab/state" "$lab/spool" "$lab/logs"
chmod 700 "$lab/logs"
(umask 077; head -c 1024 /dev/urandom >"$lab/munge.key")
cat >"$lab/slurm.conf" <<CONF
ClusterName=try
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$lab/munge.socket
CredType=cred/munge
StateSaveLocation=$lab/state
SlurmdSpoolDir=$lab/spool
SlurmctldPidFile=$lab/slurmctld.pid
SlurmdPidFile=$lab/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
ReturnToService=2
NodeName=$node NodeAddr=127.0.0.1 CPUs=2 RealMemory=4096 State=UNKNOWN
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF="$lab/slurm.conf"

munged --foreground --force --key-file "$lab/munge.key" --socket "$lab/munge.socket" \
    --pid-file "$lab/munged.pid" --log-file "$lab/logs/munged.log" --seed-file "$lab/munged.seed" 2>/dev/null &
pids+=($!)
for _ in $(seq 50); do [ -S "$lab/munge.socket" ] && break; sleep 0.1; done
slurmctld -D -f "$SLURM_CONF" -L "$lab/logs/slurmctld.log" 2>/dev/null &
pids+=($!)
slurmd -D -f "$SLURM_CONF" -L "$lab/logs/slurmd.log" 2>/dev/null &
pids+=($!)
for _ in $(seq 100); do sinfo -h -o %T 2>/dev/null | grep -q idle && break; sleep 0.2; done
sbatch --version
echo "\$ sinfo"
sinfo | tell

export OUT="$lab/sharded"
submit() {
    local log="$1"
    shift
    echo "\$ FLAGS=\"$FLAGS\" OUT=$OUT sbatch $* deploy/slurm/reproduce.sbatch" | tell
    job="$(sbatch --parsable --mem=1500M --output="$lab/logs/$log.txt" "$@" deploy/slurm/reproduce.sbatch)"
    echo "$job"
}
submit shard-%a --array=0-1
shards="$job"
submit merge --dependency=afterok:"$shards"
merge="$job"
echo "\$ squeue"
squeue -o "%.10i %.20j %.2t %E"
while [ -n "$(squeue -h -j "$shards,$merge" 2>/dev/null)" ]; do sleep 1; done
for shard in 0 1; do
    echo "\$ cat shard-$shard.txt"
    tell <"$lab/logs/shard-$shard.txt"
done
echo "\$ head -n 9 merge.txt"
head -n 9 "$lab/logs/merge.txt" | tell
echo "\$ umbracast reproduce $FLAGS --out /tmp/try/single"
# shellcheck disable=SC2086 # several words
"$UMBRACAST" reproduce $FLAGS --quiet --out "$lab/single" >/dev/null
echo "\$ diff -r --exclude run.json sharded single && echo the same"
diff -r --exclude run.json "$lab/sharded" "$lab/single" && echo "the same"
