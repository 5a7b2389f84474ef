"""`snakemake --lint`, but for its call for a conda environment or container in every rule: pip makes ours."""

import re
import subprocess
import sys

run = subprocess.run([sys.executable, "-m", "snakemake", "--lint"], capture_output=True, text=True, check=False)
found = re.findall(r"^ {4}\* (.*)$", run.stdout + run.stderr, re.MULTILINE)
kept = [title for title in found if "conda environment or container" not in title]
if kept or not (found or run.returncode == 0):
    sys.exit(run.stdout + run.stderr)
print(f"snakemake --lint: nothing but {len(found)} calls for a conda environment")
