"""Files that are written completely or not at all, and `.npz` files that may be damaged."""
