"""The operations on a keystore, a module each: create, provision, renew, roll over, remove, export."""
