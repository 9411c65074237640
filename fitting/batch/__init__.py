"""One function applied to many independent items, by one process or by many.

An engine (`Serial`, `Processes`, `Cluster`) takes

- `work`: a picklable function of one item. It writes what it makes itself, in one piece
  (`replace_file`), so that an item is there as a whole or not at all, and gives back
  something small that is picklable;
- `items`: picklable descriptions of what to do, by keys that tell them apart;
- `retries`: how often an item is tried again whose worker died, or that met an ``OSError``.

and yields a `Done` for every item, exactly once, in the order in which they end. Closing
the generator ends the workers at once; what they were at is not written. Because items are
written whole, whoever wants to go on later looks at what there is.
"""

from fitting.batch.cluster import Cluster, ClusterError
from fitting.batch.engine import Done, Engine
from fitting.batch.processes import Processes
from fitting.batch.serial import Serial
from fitting.batch.threads import cores
from fitting.batch.writing import replace_file

__all__ = [
    "Cluster",
    "ClusterError",
    "Done",
    "Engine",
    "Processes",
    "Serial",
    "cores",
    "replace_file",
]
