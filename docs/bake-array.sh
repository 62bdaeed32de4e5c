#!/usr/bin/env bash
# Bakes the scenes of a list, one a job of a Slurm array:
#
#   ls levels/*.toml > scenes.txt
#   mkdir -p bakes
#   sbatch --array=1-$(wc -l < scenes.txt) docs/bake-array.sh
#
# SCENES (scenes.txt), BAKES (bakes) and MESOLUX (mesolux) name the list, the folder of the results
# and the program; arguments go to each bake. See docs/clusters.md.
#SBATCH --job-name=mesolux
#SBATCH --gres=gpu:1
#SBATCH --cpus-per-task=8
#SBATCH --mem=16G
#SBATCH --requeue
#SBATCH --signal=B:TERM@60
set -euo pipefail
list=${SCENES:-scenes.txt}
scene=$(sed -n "${SLURM_ARRAY_TASK_ID:?this runs as a job of an array}p" "$list")
if [[ -z $scene ]]; then
    echo "$list: there is no line $SLURM_ARRAY_TASK_ID" >&2
    exit 2
fi
name=${scene##*/}
# In place of the shell, so that signals reach the bake.
exec "${MESOLUX:-mesolux}" bake "$scene" -o "${BAKES:-bakes}/${name%.*}.safetensors" "$@"
