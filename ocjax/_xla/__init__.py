"""How programs are compiled for and run on XLA's processor backend."""
