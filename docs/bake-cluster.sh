#!/usr/bin/env bash
# Bakes one scene on the devices of several machines, a process a device:
#
#   sbatch --nodes=4 docs/bake-cluster.sh SCENE -o OUT.safetensors --quality high
#
# MESOLUX (mesolux) names the program, built with --features mpi; the arguments go to the bake. The
# same command goes on from the checkpoint of one that was ended. See docs/clusters.md.
#SBATCH --job-name=mesolux
#SBATCH --ntasks-per-node=4
#SBATCH --gpus-per-task=1
#SBATCH --cpus-per-task=8
#SBATCH --mem=64G
#SBATCH --requeue
#SBATCH --signal=B:TERM@60
set -euo pipefail
# In place of the shell, so that signals reach it.
exec mpirun --map-by ppr:"${SLURM_NTASKS_PER_NODE:-1}":node "${MESOLUX:-mesolux}" bake "$@"
