"""What several tests use: recorded states, a synthetic game, checks, and the command."""
