"""Live views of the RAM while a game is played."""
