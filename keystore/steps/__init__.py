"""What is done with a keystore, a module each: create, provision, renew, roll over, remove, export."""
