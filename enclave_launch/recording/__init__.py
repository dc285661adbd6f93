"""What processes ask of librcl, recorded while they run: one recorder, used to learn, to audit and to explain."""
