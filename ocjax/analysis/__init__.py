"""Tools for reverse-engineering a game's RAM: the commands `ocjax ram ...`."""
