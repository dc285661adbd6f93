"""CAs, their keys and what they sign: certificates and S/MIME. Bytes in, bytes out; knows ``formats`` only."""
