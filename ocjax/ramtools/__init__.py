"""Tools for reverse-engineering the RAM of a game: the commands `ocjax ram ...`."""
