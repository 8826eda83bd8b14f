"""Agents that learn from objects, and the games that they play.

Training needs the extra `rl`; playing does not.
"""
