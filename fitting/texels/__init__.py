"""Many texels of a spatially varying sample, measured in the same directions.

`fit_many` takes arrays or data sets; `fitting.texels.source` and `fitting.texels.target`
are the files of `brdf texels`. Per texel the answer is that of `fitting.fit` with the same
objective and without penalties, at a small part of its time: starts come from matrix
products over all texels, of one shape unknown so near the minimum that one exact step is
mostly enough, descents go abreast in batches that the finished leave, and nothing is
compiled twice.
"""

from fitting.texels.fits import TexelFits, fit_many

__all__ = ["TexelFits", "fit_many"]
