"""The coefficients that every solver is compared with: one sparse direct solve, in float64."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import splu

from shutter_addon.core.pixels.conductances import conductances


def solve(labels: np.ndarray, count: int, guide: np.ndarray | None = None, strength: float = 0.0) -> np.ndarray:
    """Coefficients (count, h, w) float64, of sum 1, from labels (h, w): 0 free, 1 + shutter fixed.

    guide, strength: as for core.pixels.conductances; without a guide all conductances are 1
    Labels without any scribble give the first shutter everywhere.
    """
    free = (labels == 0).ravel()
    values = (labels.ravel()[:, None] == np.arange(1, count + 1)).astype(float)
    if free.all():
        values[:, 0] = 1
    elif free.any():
        height, width = labels.shape
        cells = np.arange(labels.size).reshape(height, width)
        right, down = (
            (np.ones((height, width - 1)), np.ones((height - 1, width)))
            if guide is None
            else conductances(guide, strength, labels.shape)
        )
        one = np.concatenate([cells[:, :-1].ravel(), cells[:-1].ravel()])
        other = np.concatenate([cells[:, 1:].ravel(), cells[1:].ravel()])
        ties = np.concatenate([right.ravel(), down.ravel()])
        pairs = np.r_[one, other], np.r_[other, one]
        links = coo_matrix((np.r_[ties, ties], pairs), shape=(labels.size,) * 2).tocsr()
        laplacian = (diags(np.asarray(links.sum(axis=1)).ravel()) - links).tocsr()[free]
        values[free] = splu(laplacian[:, free].tocsc()).solve(-laplacian[:, ~free] @ values[~free])
    return values.T.reshape(count, *labels.shape)
