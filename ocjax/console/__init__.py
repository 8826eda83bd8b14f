"""The Atari 2600: its RAM, ROM, registers and colours, and the building blocks of decoders."""
