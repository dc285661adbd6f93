"""The kernel of inference: values, a store with program order, contexts, callbacks, conditions, findings.

It knows neither Python nor C++. A front end walks a syntax tree and speaks to it in a small vocabulary:

=====================  ======================================================================
assign, read           ``Machine.store.write``, ``Machine.store.read``
new                    ``Machine.allocate``: one object for each place and context
call                   ``Machine.in_context``: runs a body in the context of its argument values
branch                 ``Machine.branch``: both sides on one store, then joined
loop                   ``Machine.each_element`` (known elements), ``Machine.repeat`` (any number of turns)
return, break ...      the ways that a statement leaves by, and ``Jumps``
callback               ``Machine.later``, ``Machine.settle``
make an interface      ``Machine.endpoint``
what is not known      ``Machine.gap``
=====================  ======================================================================
"""
