"""The Atari 2600: its RAM, ROM, registers and colours, and what decoders are written with."""
