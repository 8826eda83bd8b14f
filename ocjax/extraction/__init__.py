"""Objects from RAM and pixels: game declarations, and the two extraction methods."""
