"""Playing games: policies, recordings of play, and fixtures for tests."""
