"""A fit to look at and to play with: lobe, lit sphere, slices and albedo in a web page.

The page is one file that loads nothing. Its graphics hardware evaluates the model itself,
translated from the one definition that was fitted, so that sliders change all there is.
"""

from fitting.viewer.blocks import TranslationError
from fitting.viewer.page import fragment, page, write

__all__ = ["TranslationError", "fragment", "page", "write"]
