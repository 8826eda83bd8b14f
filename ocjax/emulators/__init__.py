"""Emulators of the Arcade Learning Environment, stepped in batches."""
