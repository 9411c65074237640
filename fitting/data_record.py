"""What a result says about the data that were fitted."""

from __future__ import annotations

import math

from data_formats import Measurement
from fitting import diagnostics
from fitting.result import Data, DataAlbedo, DataNote, DataReciprocity
from fitting.rows import Rows


def data_record(m: Measurement, rows: Rows, index: float) -> Data:
    """The data of a fit; ``index`` is that behind the sample relative to the front."""
    reciprocity = diagnostics.data_reciprocity(m)
    through = diagnostics.data_transmitted_reciprocity(m, index)
    return Data(
        path=m.provenance.path,
        sha256=m.provenance.sha256,
        format=m.provenance.format,
        instrument=m.provenance.instrument,
        sample=m.provenance.sample,
        date=m.provenance.date,
        symmetry=m.symmetry,
        rows=m.n_rows,
        rows_used=int(rows.index.size),
        left_out=list(rows.left_out),
        notes=[DataNote(n.code, n.sentence, n.count) for n in m.notes],
        reciprocity=None if reciprocity is None else DataReciprocity(*reciprocity),
        albedo=[
            DataAlbedo(math.degrees(a.theta_i), *a[1:]) for a in diagnostics.data_albedo(m)
        ],
        reciprocity_transmitted=None
        if through is None
        else DataReciprocity(*through, relative_index=index),
    )
