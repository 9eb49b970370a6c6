#!/usr/bin/env bash
# Scores all bundles of a shared folder again, a share on each of 100 tasks: sbatch slurm.sh /shared/sessions /shared/rescored
# What is scored is left alone, so that the same line submitted again does only what is missing.
#SBATCH --job-name=typodont-rescore
#SBATCH --array=1-100
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --mem=2G
#SBATCH --time=12:00:00
#SBATCH --requeue
set -euo pipefail
srun typodont rescore "$1" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" --out "$2"
