"""Evidence about a launch for those who must sign for a product: what was decided, checked, and not checked.

requirements.py   which part supports which requirement of the Cyber Resilience Act, IEC 62443 and ISO 10218
matrix.py         who may do what, and why
surface.py        what can be reached from outside of an enclave, and from outside of the launch
documents.py      all files of the evidence, from values, and the in-toto statement that names them by their hashes

It claims no conformity: whether a requirement is met is for the manufacturer, who knows the product, to say.
"""
