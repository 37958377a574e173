#!/usr/bin/env bash
# Jobs of `tweenray slurm` under a real Slurm: they finish by themselves, with the bytes of a job that
# nobody disturbed. `./x slurm-test` calls it, with the program.
#
# The folder must be one that all nodes see. TWEENRAY_SLURM_SETUP holds a line of shell that jobs need before
# MPI starts here, TWEENRAY_SLURM_NODES how many nodes to use (4).
set -euo pipefail

tweenray=$1
folder=$2
nodes=${TWEENRAY_SLURM_NODES:-4}
setup=${TWEENRAY_SLURM_SETUP:-:}
# What a run of a minute has for itself: the program stops half a minute before the end of its
# allocation, and needs a little to start.
usable=25
jobs=()

say() { printf '%s\n' "slurm-test: $*"; }
die() { say "FAILED: $*" >&2; exit 1; }
# Only what it sent itself.
clean_up() { [[ ${#jobs[@]} == 0 ]] || scancel --quiet "${jobs[@]}" 2>/dev/null || true; }
trap clean_up EXIT

rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"
cat >scene.toml <<'END'
camera = { frames = 96, orbit = { target = [0, 0.5, 0], eye = [0, 2.6, 7], degrees = 90 } }
sky = { radiance = [0.4, 0.5, 0.7], lights = true }
light = [{ quad = { centre = [-4, 6, 4], normal = [4, -5, -4], size = [2, 2], radiance = 35 } }]
material.silver = { mirror = 0.9 }
material.sand = { diffuse = [0.5, 0.42, 0.3] }
mesh = [{ terrain = { vertices = 60, size = 12 }, material = "sand" }]
sphere = [{ centre = [0, 1.4, 0], radius = 1, material = "silver" }]
END
# A key frame takes a small part of a limit, and with a tolerance that is given the time goes with the samples.
options=(--size 320x180 --segment 8 --tolerance 1 --no-video)

# seconds COMMAND...: how long it takes.
seconds() {
  local start=$EPOCHREALTIME
  "$@" >&2 || return
  awk -v a="$start" -v b="$EPOCHREALTIME" 'BEGIN { print b - a }'
}

# trial SPP: how long the sequence takes on the nodes, seconds.
trial() {
  local line=(srun --nodes="$nodes" --ntasks-per-node=1 --cpus-per-task=1 --mpi=pmix "$tweenray" render)
  line+=(scene.toml "${options[@]}" --quiet --threads 1 --spp "$1" --overwrite -o "trial$1/f_##.png")
  local try
  # A process of the step before may still speak to the new ones, which crashes MPI as it starts.
  for try in 1 2 3; do
    seconds bash -c "$setup"$'\n''exec "$@"' bash "${line[@]}" && return
    sleep 5
  done
  die "srun --mpi=pmix does not run here"
}

# An undisturbed run, as large as two and a half limits take on the nodes: measured there, since they
# may be quicker than this machine, or share it. Two trials, so that the start does not count.
make_yardstick() {
  local few many spp
  few=$(trial 4)
  many=$(trial 16)
  spp=$(awk -v few="$few" -v many="$many" -v all="$((usable * 5 / 2))" \
    'BEGIN { print int(12 * all / (many > few ? many - few : few)) + 1 }')
  options+=(--spp "$spp")
  say "4 and 16 samples a pixel took $few s and $many s on $nodes nodes: $spp for two and a half limits"
  "$tweenray" render scene.toml "${options[@]}" --quiet -o 'whole/f_##.png'
}

# What processes get and use in the jobs that are to take long: a core each.
shape=(--cpus 1)
words=(--threads 1)

# send NAME TIME: sends a job of this shape, with these words for `render`, whose frames go to NAME, and
# sets `job`.
send() {
  "$tweenray" slurm scene.toml --nodes "$nodes" "${shape[@]}" --time "$2" --setup "$setup" \
    --sbatch "output=$1.log" --sbatch "job-name=tweenray-$1" \
    -- "${options[@]}" "${words[@]}" -o "$1/f_##.png" >"$1.sh"
  job=$(sbatch --parsable "$1.sh")
  jobs+=("$job")
}

state() { scontrol show job "$1" 2>/dev/null | grep -oE 'JobState=\w+' | cut -d= -f2; }

# wait_for JOB NAME: until it is done; a requeued job need not wait for its turn.
wait_for() {
  local deadline=$((SECONDS + 1200)) now last='' since=$SECONDS
  while now=$(state "$1") && [[ $now != COMPLETED ]]; do
    if [[ $now != "$last" ]]; then
      say "$2: ${now,,}"
      last=$now since=$SECONDS
    fi
    case $now in
      FAILED | TIMEOUT | CANCELLED | NODE_FAIL | OUT_OF_MEMORY | BOOT_FAIL)
        cat "$2.log" >&2
        die "$2: the job ended as $now"
        ;;
      # Nodes need a moment to clear up, not two minutes.
      PENDING) [[ $((SECONDS - since)) -lt 10 ]] || scontrol update JobId="$1" StartTime=now 2>/dev/null || true ;;
    esac
    if [[ $SECONDS -gt $deadline ]]; then
      cat "$2.log" >&2
      die "$2: not done after 20 minutes"
    fi
    sleep 1
  done
}

# same NAME: the frames are those of the undisturbed run.
same() {
  local frame
  "$tweenray" status "$1/f_##.png" >/dev/null || die "$1: not complete"
  for frame in whole/*.png; do
    cmp -s "$frame" "$1/${frame##*/}" || die "$1: ${frame##*/} differs"
  done
}

runs() { grep -c '^== ' "$1.log"; }

limits() {
  send limits 1m
  wait_for "$job" limits
  same limits
  [[ $(runs limits) -ge 3 ]] || die "limits: $(runs limits) runs; three were meant to be needed"
  say "limits: done by itself in $(runs limits) runs of a minute, and the bytes are the same"
}

node_lost() {
  local node
  send node 10m
  until compgen -G 'node/*.png' >/dev/null; do
    [[ $(state "$job") =~ PENDING|CONFIGURING|RUNNING ]] || die "node: the job did not run"
    sleep 0.2
  done
  # Not the first: there the script runs.
  node=$(scontrol show hostnames "$(squeue -h -j "$job" -o %N)" | tail -n 1)
  if ! scontrol update NodeName="$node" State=DOWN Reason=tweenray-slurm-test; then
    say "node: skipped, since only Slurm's administrator may take a node down"
    return
  fi
  sleep 5
  # It may be back already.
  scontrol update NodeName="$node" State=RESUME 2>/dev/null || true
  wait_for "$job" node
  same node
  [[ $(runs node) -ge 2 ]] || die "node: it was not requeued"
  say "node: done by itself in $(runs node) runs with $node taken down in between, and the bytes are the same"
}

# Each process would take itself for the only one, and render all.
wrong_mpi() {
  if ! srun --mpi=list 2>&1 | grep -qw pmi2; then
    say "wrong --mpi: skipped, since this Slurm has no pmi2"
    return
  fi
  local status=0
  srun --nodes=2 --ntasks-per-node=1 --mpi=pmi2 "$tweenray" render scene.toml "${options[@]}" \
    -o 'wrong/f_##.png' >wrong.log 2>&1 || status=$?
  [[ $status == 2 ]] && grep -q 'srun --mpi=pmi2 started 2 processes, but MPI knows of one only' wrong.log || { cat wrong.log >&2; die "wrong --mpi ended with $status"; }
  [[ ! -e wrong ]] || die "wrong --mpi: frames were rendered"
  say "wrong --mpi: refused"
}

# Whole nodes, which two processes each share out as they find them.
whole_nodes() {
  local frame
  local shape=(--tasks-per-node 2) words=(--frames 1..8)
  send nodes 10m
  wait_for "$job" nodes
  for frame in whole/f_0[1-8].png; do
    cmp -s "$frame" "nodes/${frame##*/}" || die "nodes: ${frame##*/} differs"
  done
  say "nodes: done with two processes on each of $nodes whole nodes, and the bytes are the same"
}

wrong_mpi
make_yardstick
whole_nodes
limits
node_lost
say "passed"
