"""A study on computers that SLURM lends. Not run here: there is no SLURM.

pip install "tolstat[cluster]" dask-jobqueue, then: python runs/cluster.py
"""

from dask_jobqueue import SLURMCluster

import tolstat
from tolstat.execution.workers.cluster import Cluster

LENT = {"cores": 16, "processes": 1, "memory": "32 GB", "walltime": "02:00:00"}

if __name__ == "__main__":
    with SLURMCluster(queue="normal", job_name="tolstat", **LENT) as lent:
        lent.scale(jobs=8)  # as many computers; the run begins with the first
        with Cluster(lent.scheduler_address) as cluster:
            tolstat.run("runs/khpt75.toml", executor=cluster)
