"""Shared code of tests: recorded states, a synthetic game, checks, and the command."""
