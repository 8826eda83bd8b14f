"""Pixels to boxes: the palette, colour masks and connected components, all in pure JAX."""
