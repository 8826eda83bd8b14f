"""Objects from RAM and pixels: what a game declares, and the two methods that extract by it."""
