#!/usr/bin/env bash
# script/slurm/run against a real Slurm of its own: one node on loopback, in a scratch folder, with its own munge.
#   run_test.sh PROGRAM SOURCE_FOLDER
# Exit code 77: skipped, as Slurm isn't there (Debian: slurmctld slurmd slurm-client munge) or we aren't root.
set -euo pipefail
program=$1 source=$2
PATH=$PATH:/usr/sbin:/sbin
for needed in slurmctld slurmd sbatch squeue scontrol munged; do
  command -v "$needed" >/dev/null || { echo "skipped: $needed isn't there (slurmctld slurmd slurm-client munge)"; exit 77; }
done
[ "$(id -u)" -eq 0 ] || { echo "skipped: slurmd needs root"; exit 77; }

D=$(mktemp -d /tmp/touchstone-slurm.XXXXXX)
export SLURM_CONF=$D/slurm.conf
stop() {
  for pid in "$D"/*.pid; do [ -e "$pid" ] && kill "$(cat "$pid")" 2>/dev/null || true; done
  sleep 1
  rm -rf "$D"
}
trap stop EXIT
mkdir -p "$D"/{state,spool,log,munge}
chmod 0755 "$D" "$D/munge"
(umask 077; head -c 128 /dev/urandom >"$D/munge.key")
munged --force --key-file="$D/munge.key" --socket="$D/munge/socket" --pid-file="$D/munged.pid" \
  --log-file="$D/log/munged.log" --seed-file="$D/munged.seed"
host=$(hostname -s)
port=$((20000 + $$ % 20000))
cat >"$SLURM_CONF" <<C
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
AuthType=auth/munge
AuthInfo=socket=$D/munge/socket
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$D/state
SlurmdSpoolDir=$D/spool
SlurmctldPidFile=$D/slurmctld.pid
SlurmdPidFile=$D/slurmd.pid
SlurmctldLogFile=$D/log/slurmctld.log
SlurmdLogFile=$D/log/slurmd.log
SlurmdParameters=config_overrides
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
ReturnToService=2
SchedulerParameters=sched_min_interval=0,batch_sched_delay=0
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=2 RealMemory=1000 State=UNKNOWN
PartitionName=test Nodes=ALL Default=YES MaxTime=INFINITE State=UP
C
slurmctld -f "$SLURM_CONF" -c
slurmd -f "$SLURM_CONF" -N n1
for _ in $(seq 200); do sinfo -h -o %T 2>/dev/null | grep -q idle && break; sleep 0.1; done
sinfo -h -o %T | grep -q idle || { cat "$D"/log/*; echo "Slurm doesn't start"; exit 1; }

fail() {
  echo "FAILED: $1"
  tail -n +1 "$D"/work/out.slurm/* 2>/dev/null || true
  exit 1
}
wait_for_jobs() {
  for _ in $(seq 1800); do [ -z "$(squeue -h)" ] && return; sleep 0.1; done
  squeue
  fail "jobs don't end"
}
mkdir "$D/work"
cat >"$D/work/job.yaml" <<J
name: ten-touches
seed: 5
samples: 10
samples_per_file: 3
membrane_um: 120
draw:
  device: $source/python/examples/quick-sensor.yaml
  units: {count: 2, vary: [{path: 'lamps[*].power_W', times: {uniform: [0.7, 1.3]}}]}
  objects: [{file: $source/python/examples/quick-ball.yaml}]
  place_mm: {x: {uniform: [-1, 1]}, y: {uniform: [-1, 1]}}
  force_N: {log_uniform: [0.1, 0.5]}
outputs: [frame]
J
# The program, but shard 2 fails as often as $D/work/failures says.
cat >"$D/work/touchstone" <<P
#!/usr/bin/env bash
left=\$(cat "$D/work/failures")
case " \$* " in
  *" --shard 2/4 "*) if [ "\$left" -gt 0 ]; then echo \$((left - 1)) >"$D/work/failures"; exit 7; fi ;;
esac
exec "$program" "\$@"
P
chmod +x "$D/work/touchstone"
run() { TOUCHSTONE=$D/work/touchstone "$source/script/slurm/run" "$D/work/job.yaml" "$D/work/$1" 4 --cpus-per-task=1; }
"$program" --quiet generate "$D/work/job.yaml" -o "$D/work/whole"

echo "--- a shard that fails more often than it's retried: no merge, and only it is submitted again"
echo 2 >"$D/work/failures"
text=$(run out); echo "$text"
grep -q "shards 1,2,3,4 of 4 submitted" <<<"$text" || fail "not all shards were submitted"
text=$(run out); echo "$text"
grep -q "still in the queue" <<<"$text" || fail "what is in the queue was submitted twice"
wait_for_jobs
[ ! -e "$D/work/out/dataset.json" ] || fail "merged although a shard failed"
grep -q "exit code 7, after 1 of 1 retries" "$D"/work/out.slurm/shard-2.*.log || fail "the log doesn't say what failed"
text=$(run out); echo "$text"
grep -q "shards 2 of 4 submitted" <<<"$text" || fail "not just the failed shard was submitted"
wait_for_jobs
diff -r "$D/work/whole" "$D/work/out" || fail "the cluster's set isn't the single run's"
text=$(run out); echo "$text"
grep -q "is finished" <<<"$text" || fail "a finished set isn't known"

echo "--- a shard that fails once is tried again by itself"
echo 1 >"$D/work/failures"
run again
wait_for_jobs
diff -r "$D/work/whole" "$D/work/again" || fail "the set after a retry isn't the single run's"
[ "$(cat "$D/work/failures")" = 0 ] || fail "shard 2 didn't fail"
echo "all as it should be"
