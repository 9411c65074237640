"""One small good file of each format of the databases and programs of computer graphics."""

from __future__ import annotations

import numpy as np
from tensor_files import kaist_fields, rgl_fields, tensor_file
from xml_files import bases, document, matrix, random_tree, tree

_RINGS = [(0, 30, 1), (30, 90, 3)]
_WAYS = ("Reflection Front", "Transmission Back")
_ANGLES = np.linspace(0.1, 1.2, 24).reshape(8, 3)
_HEADER = "#DIM 3 2\n#PARAM_IN RUSIN_TH_TD_PD\n#PARAM_OUT INV_STERADIAN\n#VS 1\n"
_ROWS = np.column_stack([_ANGLES / 2, _ANGLES[:, :2], _ANGLES[:, :2] / 100])


def _klems() -> str:
    numbers = np.linspace(0.1, 0.3, 16).reshape(4, 4)
    blocks = [
        matrix(w, numbers, "own", "own", band) for w in _WAYS for band in ("NIR", "550")
    ]
    return document("Columns", *blocks, definition=bases(own=_RINGS))


def _tree(rank: int) -> str:
    made = [random_tree(rank, np.random.default_rng(k), 2) for k in range(1 << rank)]
    return document(f"TensorTree{rank}", *(tree(w, made) for w in _WAYS))


def _alta() -> str:
    return _HEADER + "\n".join(" ".join(map(repr, row)) for row in _ROWS.tolist())


def _binary_alta() -> bytes:
    more = f"#FORMAT binary\n#SAMPLE_COUNT {len(_ROWS)}\n#ENDIAN little\n#BEGIN_STREAM\n"
    return (_HEADER + more).encode() + _ROWS.astype("<f8").tobytes() + b"\n#END_STREAM\n"


SOUND: dict[str, bytes] = {
    "one.bsdf": tensor_file(rgl_fields([0.0])),
    "several.bsdf": tensor_file(rgl_fields(list(np.linspace(-np.pi, 0, 4)))),
    "made.pbsdf": tensor_file(kaist_fields(5, 3)),
    "klems.xml": _klems().encode(),
    "three.xml": _tree(3).encode(),
    "four.xml": _tree(4).encode(),
    "text.alta": _alta().encode(),
    "binary.alta": _binary_alta(),
}
