"""The abstract interpreter: Python syntax in, findings out; nothing of the program is executed.

``run`` holds the core, ``statements``, ``expressions``, ``loops``, ``define``, ``imports``, ``calls`` and
``attributes`` one concern each, ``tables`` puts them together; what foreign libraries do stands in
``enclave_addons.inference.models``.
"""
